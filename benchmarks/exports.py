"""Peak memory of an export of many answers, of its check and of its import.

    python -m benchmarks.exports                          5,000 and 30,000 answers
    python -m benchmarks.exports --answers 5000 200000    other numbers, from the smallest on

The rows are written straight into a database in a temporary folder, chained as the server chains them. Then
`parenting export`, `export --check` and `import` run as processes of their own, and the system tells the most
memory that each has used and its processor time. `bytes an answer` is the slope of the memory from the first
number to this one: what an answer more costs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from sqlalchemy import insert, update

from parenting.server import chain
from parenting.server.db import Database, connect
from parenting.server.migrate import upgrade
from parenting.server.new_run import NewRun, start
from parenting.server.public_ids import public_id
from parenting.server.settings import Settings
from parenting.server.tables import Answer, Query, Run
from tests.server.conftest import CLIPS

ANSWERS, BATCH = (5_000, 30_000), 5000
BETWEEN = """
import os, sys
child = os.fork()
if child == 0:
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.execv(sys.argv[1], sys.argv[1:])
_, status, used = os.wait4(child, 0)
print(used.ru_maxrss, used.ru_utime + used.ru_stime)
sys.exit(os.waitstatus_to_exitcode(status) != 0)
"""
"""A small process between: Linux counts the memory of whoever starts a process as that process's peak."""
CHOICES = ("left", "right", "either", "neither")


class Used(NamedTuple):
    """The costs of a process: its peak of resident memory in MB (10^6 bytes), and processor time."""

    megabytes: float
    seconds: float


def main() -> None:
    """Measure each number of answers, and print a row for each command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--answers", type=int, nargs="+", default=ANSWERS)
    print(f"{'command':16} {'answers':>9} {'peak memory':>12} {'bytes an answer':>16} {'ms an answer':>13}")
    first: dict[str, tuple[int, float]] = {}
    for answers in parser.parse_args().answers:
        for name, used in measured(answers):
            few, little = first.setdefault(name, (answers, used.megabytes))
            slope = f"{1e6 * (used.megabytes - little) / (answers - few):.0f}" if answers > few else ""
            cost = 1e3 * used.seconds / answers
            print(f"{name:16} {answers:9} {used.megabytes:9.0f} MB {slope:>16} {cost:13.2f}", flush=True)


def measured(answers: int) -> Iterator[tuple[str, Used]]:
    """Write the answers, run the three commands, and yield what each has used."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        full = prepared(folder / "full")
        fill(full, answers)
        full.close()
        prepared(folder / "empty").close()
        file = str(folder / "study.zip")
        yield "export", used(folder / "full", ["export", "1", "--out", file])
        yield "export --check", used(folder / "full", ["export", "--check", file])
        yield "import", used(folder / "empty", ["import", file])


def prepared(data: Path) -> Database:
    """An empty database."""
    db = connect(Settings(data=data, database_url=None))
    upgrade(db)
    return db


def fill(db: Database, answers: int) -> None:
    """Begin a run, and write its questions and answers in batches."""
    start(db, NewRun(world="unsafe-exploration", config={"pretrain": False}))
    with db.write() as session:
        session.execute(update(Run).values(answers=answers, tick=2 * answers, status="paused"))
    rows = pairs(db, answers)
    while batch := [row for _, row in zip(range(BATCH), rows, strict=False)]:
        with db.write() as session:
            session.execute(insert(Query), [query for query, _ in batch])
            session.execute(insert(Answer), [answer for _, answer in batch])


def pairs(db: Database, answers: int) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Questions with their answers, each heard in the tick after it was asked."""
    now, link = db.clock(), chain.BEGIN
    for number in range(1, answers + 1):
        query = {
            **{"id": number, "public_id": public_id(), "run_id": 1, "tick": 2 * number - 1},
            **{"kind": "guidance", "maturity": 1, "clips": CLIPS, "status": "applied", "posted": now},
            **{"votes": 0, "put_back": False, "policy_stage": 1, "policy_steps": number},
        }
        said: dict[str, Any] = {
            **{"id": number, "query_id": number, "run_id": 1, "number": number, "parent": "human"},
            **{"choice": CHOICES[number % 4], "client_id": "somebody", "received": now, "standing": True},
            "applied_tick": 2 * number,
        }
        said |= chain.hashes(said, query, link)
        link = said["link"]
        yield query, said


def used(data: Path, command: list[str]) -> Used:
    """Run a command, and return what it has used.

    Raises:
        SystemExit: it has failed.
    """
    begin = "from parenting.commands.main import app; app()"
    found = subprocess.run(
        [sys.executable, "-S", "-c", BETWEEN, sys.executable, "-c", begin, *command],
        env=os.environ | {"PARENTING_DATA": str(data)},
        stdout=subprocess.PIPE,
        text=True,
    )
    if found.returncode:
        raise SystemExit(f"`parenting {' '.join(command)}` ended with {found.returncode}.")
    kibibytes, seconds = found.stdout.split()
    return Used(int(kibibytes) * 1024 / 1e6, float(seconds))


if __name__ == "__main__":
    main()

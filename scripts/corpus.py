"""Data of this version for the tests of later ones: `make corpus` writes tests/old/VERSION.

    python -m scripts.corpus make [FOLDER]    write data.tar.xz and expected.json; FOLDER must not exist
    python -m scripts.corpus check FOLDER     open it with this version, replay its runs, go on with them

Each version adds one folder, made by itself, and never changes it again. `tests/server/test_corpus.py` checks
all of them with the present version. The bits of a run depend on the vector instructions that torch uses, so
they are pinned, by ATEN_CPU_CAPABILITY, to those that every machine has; without it both commands refuse.

The data folder holds three runs: a scripted one that has finished; one of a parent, half answered, with a
changed probability, an early end of a stage and ticks after its last checkpoint; and a garden whose worker
wrote no checkpoint yet. Beside the database lies the table of answers of each, and beside the folder, since
version 0.7.0, `runs.zip`, the export of all. `expected.json` says how the making
version went on with the second and the third once every question was answered *left*.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import tarfile
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import structlog
import torch
from torch import Tensor

from parenting.server import runs
from parenting.server.archive.format1 import read_table
from parenting.server.archive.format1_import import import_table
from parenting.server.archive.importing import import_export
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.db import Database, connect
from parenting.server.export import lines
from parenting.server.exports import Part, exported
from parenting.server.migrate import upgrade
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.queue import answers, leases, worker_side
from parenting.server.replay import relive
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus

CAPABILITY = "default"
ROOT = Path(__file__).parents[1]
FINISHED, HALF, EARLY = 1, 2, 3
CHOICES = ("left", "right", "either", "left")
EXPORT = "runs.zip"
SAVED_AT, EVENT_AT, MATURE_AT = 8, 5, 12
"""Answers of the second run before its only checkpoint and before its events."""
GOES_ON = 12
"""Answers that runs are given when they go on."""


def make(folder: Path) -> None:
    """Write the data of this version into a new folder.

    Raises:
        FileExistsError: there is data of this version already.
    """
    folder.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as name:
        data = Path(name) / "data"
        db = connect(Settings(data=data, database_url=None))
        upgrade(db)
        _live(db)
        for run in (FINISHED, HALF, EARLY):
            (data / f"run-{run}.jsonl").write_text("".join(lines(db, run)), encoding="utf-8")
        with target(folder / EXPORT, force=False) as files:
            write_export(db, (FINISHED, HALF, EARLY), files)
        db.close()
        with tarfile.open(folder / "data.tar.xz", "w:xz") as archive:
            for file in sorted(data.glob("*.db")) + sorted(data.glob("*.jsonl")):
                archive.add(file, f"data/{file.name}")
    made = {"version": version("parenting"), "torch": torch.__version__, "cpu": CAPABILITY}
    (folder / "expected.json").write_text(json.dumps({"made": made, **check(folder)}, indent=2) + "\n")


def check(folder: Path) -> dict[str, Any]:
    """Open a folder's data with this version: replay its runs, and go on with those that are not over."""
    with tempfile.TemporaryDirectory() as name, tarfile.open(folder / "data.tar.xz") as archive:
        archive.extractall(name, filter="data")
        db = connect(Settings(data=Path(name) / "data", database_url=None))
        try:
            upgrade(db)
            replays = {}
            for run in (FINISHED, HALF):
                found = relive(db, run)
                replays[str(run)] = {"tick": found.tick, "parted": found.parted, "differ": list(found.differ)}
            imported = {str(run): _import(db, Path(name), run) for run in (FINISHED, HALF, EARLY)}
            exported = _import_export(folder / EXPORT, Path(name) / "exported")
            goes_on = {str(run): _go_on(db, run) for run in (HALF, EARLY)}
            return {"replays": replays, "imported": imported, "exported": exported, "goes_on": goes_on}
        finally:
            db.close()


def _import(db: Database, folder: Path, number: int) -> int:
    """Import the table of answers that the version wrote (format 1); return the last tick of its record."""
    run, log, data = runs.get_run(db, number), folder / "log.jsonl", folder / f"imported-{number}"
    log.write_text("".join(exported(db, number, Part.EVENTS)), encoding="utf-8")
    level = {"level_text": run.level_text, "level": None}
    new = NewRun(world=run.world, parent=run.parent, seed=run.seed, config=run.config, **level)  # type: ignore[arg-type]
    other = connect(Settings(data=data, database_url=None))
    try:
        upgrade(other)
        found = import_table(other, read_table(folder / "data" / f"run-{number}.jsonl", log), new)
        return worker_side.high_water(other, found.number)
    finally:
        other.close()


def _import_export(file: Path, data: Path) -> dict[str, Any]:
    """Import the version's export of whole runs; return, by run, its answers and where its replay parted."""
    if not file.is_file():
        return {}
    other = connect(Settings(data=data, database_url=None))
    try:
        upgrade(other)
        found = {run.number: run.answers for run in import_export(other, file)}
        parted = {number: relive(other, number).parted for number in found if number != EARLY}
        return {str(number): [answers, parted.get(number)] for number, answers in found.items()}
    finally:
        other.close()


def _live(db: Database) -> None:
    """Live the three runs."""
    start(db, NewRun(world="unsafe-exploration", parent="scripted", name="finished", seed=10))
    start(db, NewRun(world="side-effects", name="half answered", seed=2, config={"max_clip_length": 2}))
    # The garden's weights would be most of the file.
    start(db, NewRun(world="reward-hacking", name="no checkpoint yet", seed=3, config={"pretrain": False}))
    claims = {claim.run_id: claim for claim in runs.claim(db, "worker", -1)}
    sessions = {run: RunSession(db, claims[run], runs.get_run(db, run), _nobody) for run in claims}
    scripted = sessions[FINISHED]
    scripted.save_if_due = _nobody  # type: ignore[method-assign]  # the moment of a checkpoint is ours
    while not scripted.finished():
        _tick(db, scripted)
    scripted.save()
    runs.finish(db, claims[FINISHED], RunStatus.FINISHED, "Its argmax policy is optimal.")
    half = sessions[HALF]
    half.save_if_due = _nobody  # type: ignore[method-assign]
    _answer(db, half, EVENT_AT)
    add_operator_event(db, HALF, "change", {"name": "p_pref", "value": 0.4})
    _answer(db, half, SAVED_AT)
    half.save()
    _answer(db, half, MATURE_AT)
    add_operator_event(db, HALF, "mature", {})
    _answer(db, half, 16)
    early = sessions[EARLY]
    early.save_if_due = _nobody  # type: ignore[method-assign]
    _answer(db, early, 4)
    runs.let_go(db, [claims[HALF], claims[EARLY]])


def _go_on(db: Database, run: int) -> dict[str, Any]:
    """Answer a run's next questions *left*, and return what became of it."""
    claim = {claim.run_id: claim for claim in runs.claim(db, "worker", -1)}[run]
    session = RunSession(db, claim, runs.get_run(db, run), _nobody)
    _answer(db, session, runs.get_run(db, run).answers + GOES_ON, ("left",))
    state = session.saved.state
    return {
        "tick": session.last_tick,
        "answers": runs.get_run(db, run).answers,
        "parameters": _digest(state.learner.params),
        "familiarity": _digest(state.familiarity),
    }


def _answer(db: Database, session: RunSession, until: int, choices: tuple[str, ...] = CHOICES) -> None:
    """Tick and answer until the run has this many answers and waits for the next one."""
    run = session.claim.run_id
    while True:
        seen = worker_side.watch(db, [run])[run]
        if session.ready(seen):
            session.tick(seen)
        elif bool(session.saved.state.all_refused):
            add_operator_event(db, run, "end_episode", {})
        elif seen.answered >= until:
            return
        else:
            query = leases.lease(db, run, "tab")
            if query is None:
                raise RuntimeError(f"run {run} neither goes on nor asks")
            answers.answer(db, query.id, choices[seen.answered % len(choices)], "tab", "human")


def _tick(db: Database, session: RunSession) -> None:
    session.tick(worker_side.watch(db, [session.claim.run_id])[session.claim.run_id])


def _digest(tensor: Tensor) -> str:
    return hashlib.sha256(tensor.contiguous().numpy().tobytes()).hexdigest()


def _nobody() -> None:
    """Do nothing."""


def main() -> None:
    """Read the command and do it."""
    parser = argparse.ArgumentParser(description="Data of this version for the tests of later ones.")
    actions = parser.add_subparsers(required=True, dest="action")
    actions.add_parser("make").add_argument(
        "folder", type=Path, nargs="?", default=ROOT / "tests" / "old" / version("parenting")
    )
    actions.add_parser("check").add_argument("folder", type=Path)
    chosen = parser.parse_args()
    if os.environ.get("ATEN_CPU_CAPABILITY") != CAPABILITY:
        sys.exit(f"Set ATEN_CPU_CAPABILITY={CAPABILITY}: other instructions give other bits.")
    torch.set_num_threads(1)
    structlog.configure(logger_factory=structlog.PrintLoggerFactory(sys.stderr))  # the output is JSON
    does: dict[str, Callable[[Path], object]] = {"make": make, "check": check}
    found = does[chosen.action](chosen.folder)
    if found is not None:
        print(json.dumps(found))


if __name__ == "__main__":
    main()

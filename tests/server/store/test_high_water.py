"""A log that was lost is noticed at the next start, and nothing else is taken for one."""

import os
import shutil
import signal
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import PoolProxiedConnection
from structlog.testing import capture_logs

from parenting.commands import up
from parenting.server import deletion, identity
from parenting.server.db import Database, connect
from parenting.server.errors import SetupError
from parenting.server.migrate import downgrade, upgrade
from parenting.server.new_run import NewRun
from parenting.server.new_run import start as start_run
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.runs import claim as claim_runs
from parenting.server.settings import Settings
from parenting.server.store import high_water
from parenting.server.store.driver import sqlite_module
from tests.server.conftest import CLIPS
from tests.tree import ROOT

pytestmark = pytest.mark.only("sqlite", "PostgreSQL keeps its own files")

ANSWERING = """
import sys
from pathlib import Path
from parenting.server.db import connect
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.runs import claim as claim_runs
from parenting.server.settings import Settings
start, token = int(sys.argv[2]), int(sys.argv[3])
db = connect(Settings(data=Path(sys.argv[1]), database_url=None))
for tick in range(start, start + 10_000):
    query = post_query(db, Claim(1, "worker-1", token), tick, "guidance", 1, {})
    print(answer(db, query, "left", "a", "human").number, flush=True)
"""


def killed_after(data: Path, mine: Claim, start: int, answers: int) -> int:
    """Another process answers and is killed, so that its log is left; the number of the last answer told."""
    command = [sys.executable, "-c", ANSWERING, str(data), str(start), str(mine.fencing_token)]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    assert child.stdout is not None
    last = [int(child.stdout.readline()) for _ in range(answers)][-1]
    os.kill(child.pid, signal.SIGKILL)
    rest = [int(line) for line in child.communicate()[0].splitlines() if line.strip()]
    return max([last, *rest])


def test_lost_log_is_noticed_and_accepted(db: Database, mine: Claim, settings: Settings) -> None:
    file, log = settings.data / "parenting.db", settings.data / "parenting.db-wal"
    db.close()
    told = killed_after(settings.data, mine, 1, 3)
    kept = log.rename(settings.data / "kept")
    with pytest.raises(SetupError, match=r"lacks the last \d+ answers? and \d+ questions?.*doctor --accept"):
        connect(settings)
    kept.rename(log)
    again = connect(settings)
    found = high_water.counted(file)
    assert found is not None
    assert found.answers >= told
    again.close()
    killed_after(settings.data, mine, 50_000, 2)
    log.unlink()
    with pytest.raises(SetupError, match="lacks the last"):
        connect(settings)
    high_water.accept(file)
    connect(settings).close()


@pytest.mark.slow
def test_no_kill_raises_a_false_alarm(db: Database, mine: Claim, settings: Settings) -> None:
    db.close()
    for start, answers in ((1, 1), (20_000, 4), (40_000, 9)):
        told = killed_after(settings.data, mine, start, answers)
        mark = high_water.read(settings.data / "parenting.db")
        assert mark is not None
        assert told <= mark.counts.answers + 1, "it lags by what was in hand at most"
        assert high_water.lost(settings.data / "parenting.db") is None


def test_mark_is_written_after_the_commit_and_never_by_one_that_fails(
    db: Database, guidance: int, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = settings.data / "parenting.db"
    before = high_water.read(file)
    seen: list[object] = []
    real = db.engine.dialect.do_commit

    def commit(raw: PoolProxiedConnection) -> None:
        seen.append(high_water.read(file))
        if len(seen) == 1:
            raise db.engine.dialect.dbapi.OperationalError("no")  # type: ignore[union-attr]  # there is one
        real(raw)

    monkeypatch.setattr(db.engine.dialect, "do_commit", commit)
    with pytest.raises(Exception, match="no"):
        answer(db, guidance, "left", "a", "human")
    assert high_water.read(file) == before
    answer(db, guidance, "left", "a", "human")
    assert seen == [before, before]
    after = high_water.read(file)
    assert after is not None
    assert after.counts.answers == 1


def test_hurried_writes_leave_the_mark(db: Database, settings: Settings, mine: Claim) -> None:
    """They may be lost with the power."""
    before = high_water.read(settings.data / "parenting.db")
    with db.write(durable=False) as session:
        session.connection().exec_driver_sql("UPDATE run SET answers = 7")
        session.connection().exec_driver_sql("UPDATE database_identity SET last_query = 99")
    assert high_water.read(settings.data / "parenting.db") == before


def test_a_run_that_is_being_deleted_is_no_loss(db: Database, mine: Claim, settings: Settings) -> None:
    """Its answers have the largest numbers; whoever is killed between two pieces leaves the mark behind."""
    file = settings.data / "parenting.db"
    answer(db, post_query(db, mine, 1, "guidance", 1, CLIPS), "left", "a", "human")
    start_run(db, NewRun(world="unsafe-exploration"))
    mine, other = sorted(claim_runs(db, "worker-2", -1), key=lambda claim: claim.run_id)
    for tick in range(3):
        answer(db, post_query(db, other, tick, "guidance", 1, CLIPS), "left", "a", "human")
    deletion.begin(db, 2)
    while not deletion.piece(db, 2):
        assert high_water.lost(file) is None
    answer(db, post_query(db, mine, 2, "guidance", 1, CLIPS), "left", "a", "human")
    assert high_water.lost(file) is None
    mark = high_water.read(file)
    assert mark is not None
    assert mark.counts.answers == 5, "the number of an answer is given again; what was deleted counts on"


def test_copies_restores_identities_and_downgrades_are_no_loss(
    db: Database, mine: Claim, settings: Settings, tmp_path: Path
) -> None:
    file = settings.data / "parenting.db"
    older = tmp_path / "older.db"
    with closing(sqlite_module().connect(str(file))) as raw:
        raw.execute("VACUUM INTO ?", (str(older),))
    for tick in range(3):
        answer(db, post_query(db, mine, tick, "guidance", 1, CLIPS), "left", "a", "human")
    identity.renew(db)
    db.close()
    shutil.copytree(settings.data, tmp_path / "copied", ignore=shutil.ignore_patterns("copied", "older*"))
    copied = connect(Settings(data=tmp_path / "copied", database_url=None))
    downgrade(copied, "0003")
    copied.close()
    again = connect(Settings(data=tmp_path / "copied", database_url=None))
    upgrade(again)
    again.close()
    connect(Settings(data=tmp_path / "copied", database_url=None)).close()
    kept = file.rename(tmp_path / "kept.db")
    shutil.copy(older, file)
    connect(settings).close()
    kept.replace(file)
    connect(settings).close()


@pytest.mark.parametrize("length", [0, 1, 50, high_water.LENGTH - 1])
def test_mark_that_was_cut_off_says_nothing(
    db: Database, mine: Claim, settings: Settings, length: int
) -> None:
    file = settings.data / "parenting.db"
    answer(db, post_query(db, mine, 1, "guidance", 1, CLIPS), "left", "a", "human")
    mark = high_water.mark_of(file)
    whole, whole_mark = mark.read_bytes(), high_water.read(file)
    assert len(whole) == high_water.LENGTH
    mark.write_bytes(whole[:length])
    assert high_water.read(file) in (None, whole_mark)
    mark.write_bytes(whole.replace(b" 1 ", b" 9 ", 1))
    assert high_water.read(file) is None, "its sum is wrong"


def test_a_mark_that_cannot_be_written_is_told_by_up_at_its_start(
    db: Database, mine: Claim, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Root may write any, so the system's refusal is played."""
    mark = high_water.mark_of(settings.data / "parenting.db")
    assert mark.exists()
    monkeypatch.setattr(os, "access", lambda path, mode: path != mark)
    with capture_logs() as lines:
        up._migrate(settings)
    (line,) = lines
    assert line["event"] == (
        f"The mark {mark} of the database cannot be written, so a loss of what is stored from now on would "
        f"not be noticed. chmod u+rw {mark}"
    )


def test_missing_database_is_not_made_anew_in_silence(db: Database, mine: Claim, settings: Settings) -> None:
    answer(db, post_query(db, mine, 1, "guidance", 1, CLIPS), "left", "a", "human")
    db.close()
    file = settings.data / "parenting.db"
    kept = file.rename(settings.data / "kept")
    with pytest.raises(SetupError, match=r"is missing: it held 1 answer, 1 question and 1 run\."):
        connect(settings)
    assert not file.exists()
    kept.rename(file)
    connect(settings).close()
    file.unlink()
    high_water.accept(file)
    connect(settings).close()


@pytest.mark.slow
def test_file_put_beside_the_log_of_another_is_not_opened(
    db: Database, mine: Claim, settings: Settings, tmp_path: Path
) -> None:
    """SQLite would write the pages of that log into it."""
    file, older = settings.data / "parenting.db", tmp_path / "older.db"
    with closing(sqlite_module().connect(str(file))) as raw:
        raw.execute("VACUUM INTO ?", (str(older),))
    db.close()
    killed_after(settings.data, mine, 1, 3)
    older.replace(file)
    before = file.read_bytes()
    with pytest.raises(SetupError, match=r"belongs to the database file that was at .* before"):
        connect(settings)
    assert file.read_bytes() == before
    for end in ("-wal", "-shm"):
        Path(f"{file}{end}").rename(f"{file}{end}-aside")
    connect(settings).close()

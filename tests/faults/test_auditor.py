"""The auditor is silent on a sound database, and names each fault that is planted in one."""

from __future__ import annotations

from pathlib import Path

import pytest
from pysqlite3 import dbapi2 as sqlite

from parenting.server.checkpoint_parts import PART_BYTES
from parenting.server.checkpoints import save_checkpoint
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import claim
from parenting.server.settings import Settings
from tests.database import migrated
from tests.faults.auditor import Store, audit, one_parent_at_a_time
from tests.faults.ledger import Entries, Ledger, Offer, Told, read

ANSWERS = 6
ONLY = pytest.mark.only("sqlite", "faults are planted in a file")


@pytest.fixture
def house(settings: Settings) -> tuple[Path, Entries]:
    """A run with six queries: three answers heard, three not yet; two checkpoints; their client's ledger."""
    db = migrated(settings)
    run = start(db, NewRun(world="unsafe-exploration", config={}))
    (mine,) = claim(db, "worker")
    ledger = Ledger(settings.data / "ledger")
    for tick in range(1, ANSWERS + 1):
        query = post_query(db, mine, tick, "guidance", 1, {"left": {}, "right": {}})
        stored = answer(db, query, "left", "a", "human")
        ledger.told({"query": query, "run": run.id, "number": stored.number, "choice": "left"}, "a")
    for tick in (7, 8, 9):
        take_answer(db, mine, tick)
    for tick in (8, 9):
        save_checkpoint(db, mine, tick, bytes(2 * PART_BYTES))
    db.close()
    ledger.close()
    return settings.data / "parenting.db", read(settings.data / "ledger")


@ONLY
def test_sound_database_is_sound(house: tuple[Path, Entries]) -> None:
    file, entries = house
    assert len(entries.told) == ANSWERS
    assert audit(Store(file), entries) == []


@ONLY
@pytest.mark.parametrize(
    ("statement", "found"),
    [
        ("DELETE FROM answer WHERE number = 6", "A1 told and stored 0 times"),
        ("UPDATE answer SET choice = 'right' WHERE number = 2", "A1 told and stored 0 times"),
        ("UPDATE answer SET client_id = 'b' WHERE number = 2", "A1 told and stored 0 times"),
        ("UPDATE answer SET query_id = 1 WHERE number = 2", "A2 query 1 has 2 answers"),
        ("UPDATE answer SET query_id = 1 WHERE number = 2", "A2 query 1 was answered twice by a"),
        ("UPDATE answer SET query_id = 99 WHERE number = 2", "belongs to no query of its run"),
        ("UPDATE answer SET number = 7 WHERE number = 2", "A5 run 1 has answers numbered"),
        ("UPDATE run SET answers = 7", "A5 run 1 counts 7 answers"),
        ("UPDATE run SET retracted = 1", "A5 run 1 counts 1 that stand no more, of 0"),
        ("UPDATE answer SET supersedes = 1 WHERE number = 2", "A2 the answers to query 2 do not follow"),
        ("UPDATE query SET status = 'open' WHERE id = 1", "query 1 is open, with an answer"),
        ("UPDATE query SET status = 'applied' WHERE id = 5", "query 5 is applied, with an answer"),
        ("UPDATE query SET tick = 1 WHERE id = 2", "C3 run 1 asked 2 times at tick 1"),
        ("UPDATE answer SET applied_tick = 7 WHERE number = 2", "C1 run 1 heard 2 answers at tick 7"),
        ("DELETE FROM checkpoint_part WHERE id = 4", "C1 the checkpoint of run 1 at tick 9 lacks some"),
        ("UPDATE checkpoint_part SET blob = x'00' WHERE id = 1", "checkpoint of run 1 at tick 8 lacks some"),
        ("INSERT INTO checkpoint SELECT * FROM checkpoint", "C1 run 1 keeps 4 checkpoints"),
        ("UPDATE checkpoint_part SET parcel = id", "C1 run 1 has parts of 4 unfinished checkpoints"),
    ],
)
def test_planted_fault_is_named(house: tuple[Path, Entries], statement: str, found: str) -> None:
    file, entries = house
    connection = sqlite.connect(str(file.with_name("plain.db")), isolation_level=None)
    connection.execute(f"ATTACH '{file}' AS kept")
    for table in (
        "run",
        "query",
        "answer",
        "checkpoint",
        "checkpoint_part",
    ):  # without constraints, which would be in the way
        connection.execute(f"CREATE TABLE {table} AS SELECT * FROM kept.{table}")
    connection.execute(statement)
    connection.close()
    sentences = audit(Store(file.with_name("plain.db")), entries)
    assert any(found in sentence for sentence in sentences), sentences


def test_question_in_two_hands_is_named() -> None:
    offers = [Offer("7", "a", 0, 60), Offer("7", "b", 59, 119)]
    assert len(list(one_parent_at_a_time(offers))) == 1
    assert list(one_parent_at_a_time([offers[0], offers[1]._replace(since=60)])) == []
    assert list(one_parent_at_a_time([offers[0], offers[1]._replace(client="a")])) == []


def test_line_that_was_cut_is_left_out(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "ledger")
    ledger.told({"query": 1, "run": 1, "number": 1, "choice": "left"}, "a")
    ledger.close()
    (tmp_path / "ledger").write_bytes((tmp_path / "ledger").read_bytes() + b'["told", "2')
    assert read(tmp_path / "ledger").told == [Told("1", "1", 1, "left", "a")]

"""Two runs in one database, and garbage for any column of the first one's rows."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from itertools import zip_longest
from typing import Any

from sqlalchemy import Column, select

from parenting.server import jobs, metrics, operator_events
from parenting.server.access.tables import AccessSession, AccessToken
from parenting.server.audit.recording import record
from parenting.server.audit.table import Kind
from parenting.server.board_tables import BoardSnapshot, BoardStates
from parenting.server.checkpoint_parts import PART_BYTES
from parenting.server.checkpoints import save_checkpoint
from parenting.server.columns import Checked, Json, Whole
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.public_ids import public_id
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query, take_answer, take_operator_events
from parenting.server.runs import claim
from parenting.server.store.sqlite import sqlite_module
from parenting.server.tables import Effect, Identity, Moves, Person, PersonName, Reason, Table
from parenting.server.tombstone_table import Tombstone
from parenting.server.weights import put as put_weights
from parenting.server.workers import sign
from tests.server.conftest import CLIPS
from tests.tree import ROOT

VICTIM, SOUND = 1, 2
GARBAGE: tuple[Any, ...] = ("\x00 garbage", b"\xff\xfe\x00", -1e308)
JSON_GARBAGE = (
    '{"left": ',
    "[1, 2]",
    "null",
    "{}",
    '{"legend": NaN, "W": 1e999}',
    "[" * 100_000,
    '{"left": {"actions": ["up"], "length": 9, "frames": []}, "right": 3}',
    '{"W": "\\ud800", "goal": {}, "deaths": "many", "name": 1}',
)


def two_runs(db: Database) -> None:
    """Each has an answer heard, one not heard yet, an open question, an event, metrics, a checkpoint."""
    put_weights(db, ROOT / "README.md")  # any bytes: no run begins with them
    for name in ("victim", "sound"):
        start(db, NewRun(world="unsafe-exploration", name=name, config={"stages": 2}))
    sign(db, "worker")
    for mine in sorted(claim(db, "worker"), key=lambda mine: mine.run_id):
        for tick in (0, 2, 4):
            query = post_query(db, mine, tick, "preference", 2, CLIPS, policy=(2, 30))
            if tick < 4:
                answer(db, query, "left", f"tab-{tick}", "human")
            if tick == 0:
                take_answer(db, mine, 1)
        operator_events.add_operator_event(db, mine.run_id, "change", {"name": "p_rec", "value": 0.5})
        take_operator_events(db, mine, 6)
        row = {"maturity": 1, "deaths": 0, "loss": 0.5, "return": 1.0, "optimal_return": 2.0}
        metrics.write_metrics(db, mine, {1: row, 3: {**row, "maturity": 2}, 5: {**row, "maturity": 2}})
        save_checkpoint(db, mine, 3, bytes(PART_BYTES + 1))
        lesson = {"tick": 1, "kind": "guidance", "cell": [1, 1], "before": [0.25] * 4, "after": [0.25] * 4}
        shown = {"milestones": {"goal": 4}, "lesson": lesson}
        report_progress(db, mine, tick=5, versions={"torch": "2"}, maturity=2, speed=1.5, **shown)
        jobs.ask(db, mine.run_id, "walk", {"seed": 0}, "me")
        there = {"probabilities": [0.25] * 4}
        recorded = {"kind": "exploitative", "first": 0, "last": 0}
        why = {"p_pref": 0.5, "draw": 0.1, **there, "clips": {"left": recorded, "right": recorded}}
        with db.write() as session:
            session.add(Moves(run_id=mine.run_id, part=0, blob=zlib.compress(bytes(5))))
            session.add(Reason(run_id=mine.run_id, tick=0, why=why))
            session.add(Effect(run_id=mine.run_id, tick=1, ticks=0, policy=there))
            session.add(BoardStates(run_id=mine.run_id, states=1, complete=True, blob=b"states"))
            numbers = {"answers": 1, "states": 1, "p_guid": 0.5, "size": 7, "blob": b"numbers"}
            session.add(BoardSnapshot(run_id=mine.run_id, tick=1, stage=1, **numbers))
    with db.write() as session:
        moment = db.clock()
        person = session.scalars(select(Person.id).limit(1)).one()  # whoever answered
        session.add(PersonName(person_id=person, name="A person", external_id="7"))
        record(db, session, Kind.OPERATOR, "pause", public_id())
        given = {"role": "researcher", "digest": "0" * 64, "created": moment, "expires": moment}
        session.add(AccessToken(kind="program", made_by="somebody", **given))
        session.add(AccessSession(last_used=moment, **given))
        session.add(Tombstone(id=99, public_id=public_id(), created=moment, deleted=moment, held={}))


def columns() -> Iterator[Column[Any]]:
    """Every column that can hold garbage: all but the numbers of rows, which SQLite itself keeps whole.

    The identity of the database belongs to no run; `test_elsewhere` damages it.
    """
    for table in Table.metadata.sorted_tables:
        if table is Identity.__table__:
            continue
        for column in table.columns:
            number = isinstance(column.type, Whole) and list(table.primary_key) == [column]
            if isinstance(column.type, Checked) and not number:
                yield column


def garbage(column: Column[Any]) -> tuple[Any, ...]:
    """Return values that a bit flip, another program or a hand could have left in a column."""
    return GARBAGE + (JSON_GARBAGE if isinstance(column.type, Json) else ())


Damage = tuple[tuple[Column[Any], Any], ...]
"""Columns, and the garbage that one row has in each."""


def each_alone() -> list[Damage]:
    """Every column with every garbage, one at a time."""
    return [((column, value),) for column in columns() for value in garbage(column)]


def all_at_once() -> list[Damage]:
    """As many columns as can be at a time, one of each table, so that each has each garbage in few cases."""
    by_table: dict[str, list[tuple[Column[Any], Any]]] = {}
    for column in columns():
        kept = JSON_GARBAGE if isinstance(column.type, Json) else GARBAGE
        at = sum(map(ord, column.name))  # spreads the garbage over the columns
        values = [kept[(at + step) % len(kept)] for step in range(0, len(kept), 4)]
        by_table.setdefault(column.table.name, []).extend((column, value) for value in values)
    return [tuple(filter(None, together)) for together in zip_longest(*by_table.values())]


@contextmanager
def damaged(db: Database, damage: Damage) -> Iterator[None]:
    """Put values into one row of each column, past every rule of the database; then all is as it was."""
    with (
        closing(sqlite_module().connect(db.engine.url.database, isolation_level=None)) as raw,
        ExitStack() as undo,
    ):
        raw.execute("PRAGMA ignore_check_constraints = 1")
        for column, value in damage:
            table, name = column.table.name, column.name
            (rowid, before) = raw.execute(f'SELECT min(rowid), "{name}" FROM "{table}"').fetchone()
            assert rowid is not None, f"no row in {table}"
            put = f'UPDATE "{table}" SET "{name}" = ? WHERE rowid = ?'
            raw.execute(put, (value, rowid))
            undo.callback(raw.execute, put, (before, rowid))
        yield


def read_lines(text: str) -> list[dict[str, Any]]:
    """The rows of an export, in JSON as the standard has it."""

    def refuse(constant: str) -> None:
        raise ValueError(constant)

    return [json.loads(line, parse_constant=refuse) for line in text.splitlines()]

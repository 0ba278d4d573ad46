"""Delete a run: in pieces, each a short transaction, so that no other write waits long for a large run.

`begin` marks the run: from then on it is not there for anybody (404), its worker's claim is lost and its
parents' answers are refused. `go_on` deletes its rows in pieces. Who is killed meanwhile leaves a marked run,
with which the worker, another request or the command goes on. A tombstone, of numbers alone, stays for good.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from datetime import datetime
from typing import Any, NamedTuple

from sqlalchemy import Table as SqlTable
from sqlalchemy import delete, func, select, tuple_
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.audit.recording import record
from parenting.server.audit.table import Kind
from parenting.server.chain import BEGIN
from parenting.server.checkpoint_parts import LONGEST_REST, REST
from parenting.server.columns import Blob
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.origins import stored_hashes
from parenting.server.public_ids import public_id
from parenting.server.runs import become, find, hold
from parenting.server.sizes import sizes_in, tables_of_runs
from parenting.server.statuses import OVER, RunStatus
from parenting.server.store.relay import announce
from parenting.server.tables import Answer, Checkpoint, Metric, OperatorEvent, Query, Run, Tombstone
from parenting.server.weights import remove_unused

ROWS = 200
"""Rows that one transaction deletes; of a table that holds bytes, such as parts of checkpoints, one."""
REASON = "It is being deleted."


class Held(NamedTuple):
    """The holdings of a run, in numbers."""

    answers: int
    questions: int
    checkpoints: int
    metrics: int
    events: int
    bytes: int


def holds(db: Database, run_id: int) -> Held:
    """Return the holdings of a run, for whoever thinks of deleting it.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        find(session, run_id)
        return _held(session, run_id)


def name_of(db: Database, run_id: int) -> str:
    """Return the public id of a run, which one that is being deleted has until the end.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        name = session.scalar(select(Run.public_id).where(Run.id == run_id))
    if name is None:
        raise NotFound(mark("There is no run {run}."), run=run_id)
    return name


def delete_run(db: Database, run_id: int, seconds: float = math.inf) -> Tombstone:
    """Delete a run, or go on with it, for so long at most; a worker goes on with what is left.

    Raises:
        NotFound: there is no such run.
    """
    if run_id not in under_way(db):
        begin(db, run_id)
    go_on(db, run_id, seconds)
    with db.read() as session:
        return session.get_one(Tombstone, run_id)


def begin(db: Database, run_id: int) -> None:
    """Mark a run as being deleted. It ends, and no worker, no parent and no operator can write to it.

    Raises:
        NotFound: there is no such run, or it is being deleted already.
    """
    with db.write() as session:
        run = hold(session, run_id)
        if sound(run, "status") not in OVER:
            become(session, run, RunStatus.STOPPED, REASON)
        run.fencing_token = (sound(run, "fencing_token") or 0) + 1
        run.worker = run.heartbeat = run.claim_epoch = run.claim_mark = None
        run.deleting = db.clock()
        record(db, session, Kind.DELETION, f"run {run_id}", sound(run, "public_id"))
        announce(session, "worker")
        announce(session, "web")


def under_way(db: Database) -> Sequence[int]:
    """Return the runs that are being deleted."""
    with db.read() as session:
        return session.scalars(_UNDER_WAY).all()


def go_on(db: Database, run_id: int, seconds: float = math.inf) -> bool:
    """Delete pieces of a run that is marked, with a rest after each; return whether nothing is left of it.

    It ends after the piece in which the `seconds` are over.
    """
    until = time.monotonic() + seconds
    while True:
        began = time.monotonic()
        if piece(db, run_id):
            return True
        if time.monotonic() >= until:
            return False
        time.sleep(min(LONGEST_REST, REST * (time.monotonic() - began)))


def piece(db: Database, run_id: int) -> bool:
    """Delete one piece of a run that is marked, in one short transaction; return whether the run is gone."""
    with db.read() as session:
        marked = session.scalar(select(Run.deleting).where(Run.id == run_id))
        buried = session.get(Tombstone, run_id) is not None
        full = next((table for table in tables_of_runs() if _has_rows(session, table, run_id)), None)
        held = Held(0, 0, 0, 0, 0, 0) if buried or marked is None else _held(session, run_id)
    if marked is None:
        return True
    with db.write(durable=full is None or not buried) as session:
        if not buried:
            _bury(session, run_id, held)
        elif full is not None:
            _delete_rows(session, full, run_id)
        else:
            return _end(session, db.clock(), run_id)
    return False


def tombstones(db: Database, before: int | None = None, limit: int = 200) -> Sequence[Tombstone]:
    """Return the tombstones of runs with smaller numbers than `before`, the largest first."""
    rows = select(Tombstone).order_by(Tombstone.id.desc()).limit(limit)
    with db.read() as session:
        return session.scalars(rows if before is None else rows.where(Tombstone.id < before)).all()


def _held(session: Session, run_id: int) -> Held:
    def count(table: type[Answer | Query | Checkpoint | Metric | OperatorEvent]) -> int:
        return session.scalar(select(func.count()).select_from(table).where(table.run_id == run_id)) or 0

    return Held(
        answers=count(Answer),
        questions=count(Query),
        checkpoints=count(Checkpoint),
        metrics=count(Metric),
        events=count(OperatorEvent),
        bytes=sizes_in(session, [run_id])[run_id],
    )


def _bury(session: Session, run_id: int, held: Held) -> None:
    """Write the tombstone, before anything is deleted. Nothing in it was written by people."""
    run = session.get(Run, run_id, with_for_update=True)
    if run is None or session.get(Tombstone, run_id) is not None:
        return  # another process was faster
    last = select(Answer.link).where(Answer.run_id == run_id).order_by(Answer.number.desc()).limit(1)
    link = session.scalar(last)
    names = ("world", "preset", "seed", "parent", "status", "tick")
    told: dict[str, Any] = {name: sound(run, name) for name in names}
    told |= {**held._asdict(), "last_link": link if isinstance(link, str) else BEGIN}
    name, marked = sound(run, "public_id") or public_id(), sound(run, "deleting")
    born = sound(run, "created") or marked
    session.add(Tombstone(id=run_id, public_id=name, created=born, deleted=marked, held=told))


def _has_rows(session: Session, table: SqlTable, run_id: int) -> bool:
    return (
        session.execute(select(table.c.run_id).where(table.c.run_id == run_id).limit(1)).first() is not None
    )


def _delete_rows(session: Session, table: SqlTable, run_id: int) -> None:
    """Delete the last rows of a run in a table: an answer that supersedes another goes before it."""
    keys = list(table.primary_key)
    most = 1 if any(isinstance(column.type, Blob) for column in table.c) else ROWS
    last = select(*keys).where(table.c.run_id == run_id)
    last = last.order_by(*(key.desc() for key in keys)).limit(most)
    session.execute(delete(table).where(tuple_(*keys).in_(last)))


def _end(session: Session, now: datetime, run_id: int) -> bool:
    """Delete the row of a run whose other rows are gone, and what it alone began with.

    SQLite keeps its number from being given again.
    """
    if any(_has_rows(session, table, run_id) for table in tables_of_runs()):
        return False  # what somebody stored between the look and this transaction
    began = session.execute(select(Run.weights, Run.origin).where(Run.id == run_id)).one_or_none()
    session.execute(delete(Run).where(Run.id == run_id, Run.deleting.is_not(None)))
    if began is not None:
        inherited = stored_hashes(began.origin) | {began.weights}
        remove_unused(session, [name for name in inherited if isinstance(name, str)])
    stone = session.get_one(Tombstone, run_id)
    stone.gone = stone.gone or now
    return True


_UNDER_WAY = select(Run.id).where(Run.deleting.is_not(None)).order_by(Run.id)

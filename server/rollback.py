"""Roll a run back to a tick, as a new run: its record up to that tick is copied, and the original stays.

The new run has the same config, seed, answers and events up to the tick, so its worker lives them again bit
for bit; from the next tick on it goes its own way. What the agent had not heard by then is asked again. The
copy is one transaction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.server import chain
from parenting.server.audit.recording import record
from parenting.server.audit.table import Kind
from parenting.server.batches import refuse_if_of_batch
from parenting.server.damage import readable
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.identity import database_id_in, unused_number
from parenting.server.notes import AGENT_KINDS, MachineChanged, read
from parenting.server.origins import ROLLED_BACK
from parenting.server.public_ids import public_id
from parenting.server.run_limits import require_room
from parenting.server.runs import hold
from parenting.server.statuses import QueryStatus
from parenting.server.store.relay import announce
from parenting.server.table_root import Table
from parenting.server.tables import SKIP, Answer, Metric, OperatorEvent, Query, Run

SETTINGS = (
    "world",
    "level",
    "level_text",
    "legend",
    "brief",
    "config",
    "preset",
    "seed",
    "parent",
    "script",
    "guidance_layout",
    "practice",
    "words",
    "remarks",
    "finish",
    "goal",
    "pace",
    "weights",
    "description",
    "tags",
)
"""The columns of a run that its copy has as they are."""
LEASE = ("leased", "leased_until", "leased_by", "lease_epoch", "lease_begin", "lease_end")
LONGEST_NAME = 100


def roll_back(db: Database, run_id: int, tick: int, name: str | None = None, most: int | None = None) -> Run:
    """Add a run that goes on from a tick of another one.

    Args:
        db: The database.
        run_id: The run whose record is copied.
        tick: The last tick that both have in common; 0 copies nothing but the settings.
        name: Its name; None names the original and the tick.
        most: The number of runs that may live; None: any.

    Raises:
        TooManyRunsError: as many live as may.
        NotFound: there is no such run.
        InvalidFieldsError: it has not come to this tick.
        Conflict: it is a trial of a batch.
        DamagedRowError: a row of the run cannot be read.
    """
    with db.write() as session:
        old = readable(hold(session, run_id))
        refuse_if_of_batch(old)
        if not 0 <= tick <= old.tick:
            raise InvalidFieldsError(
                [("tick", f"Run {run_id} has come to tick {old.tick}: write 0 to that.")]
            )
        if most is not None:
            require_room(session, most)
        new = Run(id=unused_number(session, Run), created=db.clock())
        for column in SETTINGS:
            setattr(new, column, getattr(old, column))
        behind = f" from tick {tick}"
        new.name = name or (old.name or f"Run {old.id}")[: LONGEST_NAME - len(behind)] + behind
        new.origin = {**(old.origin or {}), ROLLED_BACK: _source(session, old, tick)}
        session.add(new)
        session.flush()
        _copy_events(session, old, new, tick)
        _copy_answers(session, new, _copy_queries(session, old, new, tick), tick)
        for metric in _rows(session, select(Metric).where(Metric.run_id == old.id, Metric.tick <= tick)):
            session.add(Metric(run_id=new.id, tick=metric.tick, values=metric.values))
        session.flush()
        record(db, session, Kind.OPERATOR, f"roll back to tick {tick}, as run {new.id}", old)
        announce(session, "worker")
        return new


def _source(session: Session, old: Run, tick: int) -> dict[str, Any]:
    return {"run": old.public_id, "number": old.id, "database": database_id_in(session), "tick": tick}


def _rows(session: Session, wanted: Any) -> Sequence[Any]:
    """Return rows that can be read.

    Raises:
        DamagedRowError: one cannot be read, so the copy would not be of the same record.
    """
    return [readable(row) for row in session.scalars(wanted)]


def _values(row: Table, but: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of a row, some of them with other values."""
    names = (column.key for column in row.__mapper__.column_attrs)
    return {name: but.get(name, getattr(row, name)) for name in names}


def _copy_events(session: Session, old: Run, new: Run, tick: int) -> None:
    """Copy the operator's events, and which machine raised the run when."""
    wanted = select(OperatorEvent).where(OperatorEvent.run_id == old.id).order_by(OperatorEvent.id)
    mine: dict[str, Any] = {"id": None, "run_id": new.id}
    new.versions = old.versions
    later = True  # no change of the machine after the tick was seen yet
    for event in _rows(session, wanted):
        heard = event.kind in AGENT_KINDS and event.applied_tick is not None and event.applied_tick <= tick
        changed = read(event) if event.kind == "machine_changed" else None
        if isinstance(changed, MachineChanged):
            if (event.applied_tick or 0) <= tick:
                payload = {**event.payload, "until": min(changed.until, tick)}
                session.add(
                    OperatorEvent(**_values(event, {"id": None, "run_id": new.id, "payload": payload}))
                )
            elif later:
                new.versions, later = changed.before or None, False
        elif heard:
            session.add(OperatorEvent(**_values(event, mine)))


def _copy_queries(session: Session, old: Run, new: Run, tick: int) -> dict[int, Query]:
    """Copy the questions up to a tick; each is open until it turns out that the agent has heard its answer.

    Returns:
        The copies by the numbers of the originals.
    """
    found: dict[int, Query] = {}
    number = unused_number(session, Query)
    wanted = select(Query).where(Query.run_id == old.id, Query.tick <= tick).order_by(Query.tick)
    for place, query in enumerate(_rows(session, wanted)):
        gone = query.withdrawn_tick is not None and query.withdrawn_tick <= tick
        fresh: dict[str, Any] = {
            "id": None if number is None else number + place,
            "public_id": public_id(),
            "run_id": new.id,
            "status": QueryStatus.WITHDRAWN if gone else QueryStatus.OPEN,
            "withdrawn_tick": query.withdrawn_tick if gone else None,
            "put_back": False,
            **dict.fromkeys(
                ("leased", "leased_until", "leased_by", "lease_epoch", "lease_begin", "lease_end")
            ),
        }
        found[query.id] = Query(**_values(query, fresh))
    session.add_all(found.values())
    session.flush()
    return found


def _copy_answers(session: Session, new: Run, queries: Mapping[int, Query], tick: int) -> None:
    """Copy the answers heard by a tick, chained afresh; the last to each stands."""
    every: dict[int, Answer] = {}
    for ids in (list(queries)[place : place + 500] for place in range(0, len(queries), 500)):
        wanted = select(Answer).where(Answer.query_id.in_(ids)).order_by(Answer.number)
        every.update({answer.id: answer for answer in _rows(session, wanted)})
    heard = sorted(
        (one for one in every.values() if one.applied_tick is not None and one.applied_tick <= tick),
        key=lambda one: one.number,
    )
    last = {one.query_id: one.id for one in sorted(heard, key=lambda one: one.applied_tick or 0)}
    copies: dict[int, Answer] = {}
    link = chain.BEGIN
    for number, one in enumerate(heard, start=1):
        query = queries[one.query_id]
        fresh: dict[str, Any] = {
            "id": None,
            "query_id": query.id,
            "run_id": new.id,
            "number": number,
            "supersedes": _before(one, every, copies),
            "standing": last[one.query_id] == one.id,
        }
        values = _values(one, fresh)
        asked = {name: getattr(query, name) for name in chain.OF_QUERY}
        values |= chain.hashes(values, asked, link)
        link, copies[one.id] = values["link"], Answer(**values)
        query.status = QueryStatus.APPLIED
        session.add(copies[one.id])
        session.flush()  # so that it has an id, which a later one may name
    skips = [one for one in copies.values() if one.standing and one.choice == SKIP]
    new.answers, new.skipped = len(copies), len(skips)
    new.retracted = sum(not one.standing for one in copies.values()) + len(skips)


def _before(one: Answer, every: Mapping[int, Answer], copies: Mapping[int, Answer]) -> int | None:
    """Return the copy of what an answer superseded; what the agent never heard is passed over."""
    place = one.supersedes
    while place is not None and place not in copies:
        place = every[place].supersedes
    return None if place is None else copies[place].id

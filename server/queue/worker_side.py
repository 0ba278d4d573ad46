"""The worker's side of the queue: watch a run, post a query, take an answer, take the operator's events.

Each verb is one transaction.

**Crash and replay.** A worker that lost its memory resumes from a checkpoint and lives some ticks a second
time. Let the *high-water tick* be the largest tick of any posted query, applied answer or applied event, or
of the record that was copied from another run (`server.rollback`). At or below it, `take_answer` and
`take_operator_events` return exactly what was recorded for that tick, and `post_query` inserts nothing. So
ticks replay exactly and nothing is asked twice.

Within a tick the order is: events, answer, step, query. An event applied at a tick therefore leaves that tick
open to an answer, whereas an answer or a query closes it to both.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import (
    BindParameter,
    ColumnElement,
    ScalarSelect,
    bindparam,
    func,
    insert,
    select,
    update,
)
from sqlalchemy.orm import Session, defer
from sqlalchemy.orm.attributes import set_committed_value

from parenting.server.columns import Damaged
from parenting.server.db import Database
from parenting.server.identity import unused_number
from parenting.server.notes import AGENT_KINDS
from parenting.server.queue.lived_ticks import closed, high
from parenting.server.queue.queries import guidance_first, withdraw_guidance_in
from parenting.server.queue.taken import Taken, heard_before, recorded_at
from parenting.server.runs import Claim, held, held_status
from parenting.server.statuses import LIVING, QueryStatus, RunStatus
from parenting.server.store.relay import announce
from parenting.server.tables import Answer, OperatorEvent, Query, Table


@dataclass(frozen=True)
class Watch:
    """The state of a run that a worker needs before a tick, read at once and cheap enough for a poll."""

    run_id: int
    status: RunStatus
    fencing_token: int
    worker: str | None
    open_guidance: int
    open_preferences: int
    answers: int  # given and not yet heard
    answered: int  # given since its birth, those that stand
    goal: int | None  # answered questions after which it rests
    pace: float | None  # ticks a second at most
    events: int  # not yet applied
    corrections: int = 0  # of answers that were heard, themselves not yet heard
    person: bool = False  # its parent is one, who waits for its next question

    @property
    def urgent(self) -> bool:
        """Return whether a person waits for the next question, or for an answer to be heard."""
        asked = self.open_guidance or self.open_preferences
        return self.person and bool(self.answers or self.corrections or not asked)

    @property
    def at_leisure(self) -> bool:
        """Return whether a person has guidance to give and the agent nothing to hear: only rows are due."""
        news = self.answers or self.corrections or self.events
        return self.person and self.status is RunStatus.ACTIVE and bool(self.open_guidance and not news)

    @property
    def goal_reached(self) -> bool:
        """Return whether the goal of answers is reached; the worker then looks before each tick."""
        return self.goal is not None and self.answered >= self.goal

    @property
    def idle(self) -> bool:
        """Return whether the agent rests: the goal is reached, and every answer is heard."""
        return self.goal_reached and not self.answers


# Statements that every tick needs are built once, of tables where no object of a class is wanted: that is
# half of the work.
_RUN: BindParameter[int] = bindparam("run_id")
_NAMES = ("run", "query", "answer", "event")
_RUNS, _QUERY, _ANSWER, _EVENT = (Table.metadata.tables[name] for name in _NAMES)
_PENDING = (
    select(Answer, Query)
    .options(defer(Query.clips))
    .join(Query, Answer.query_id == Query.id)
    .where(Query.run_id == _RUN, Query.status == QueryStatus.ANSWERED, Answer.standing)
    .order_by(guidance_first(), Query.tick)
    .limit(1)
)
_HEARD = (
    update(_ANSWER).where(_ANSWER.c.id == bindparam("answer")).values(applied_tick=bindparam("tick")),
    update(_QUERY).where(_QUERY.c.id == bindparam("query")).values(status=QueryStatus.APPLIED),
)
_POSTED = insert(_QUERY).returning(_QUERY.c.id)
_KNOWN = select(_QUERY.c.id).where(_QUERY.c.run_id == _RUN, _QUERY.c.tick == bindparam("tick"))


def _number(*conditions: ColumnElement[bool]) -> ScalarSelect[int]:
    return select(func.count()).where(*conditions).correlate(_RUNS).scalar_subquery()


def _asked(status: QueryStatus, *conditions: ColumnElement[bool]) -> ScalarSelect[int]:
    return _number(_QUERY.c.run_id == _RUNS.c.id, _QUERY.c.status == status, *conditions)


_CORRECTIONS = (
    select(func.count())
    .select_from(_ANSWER.join(_QUERY, _ANSWER.c.query_id == _QUERY.c.id))
    .where(_ANSWER.c.run_id == _RUNS.c.id, _ANSWER.c.applied_tick.is_(None), _ANSWER.c.standing)
    .where(_QUERY.c.status == QueryStatus.APPLIED)
    .correlate(_RUNS)
    .scalar_subquery()
)
_WATCH = select(
    _RUNS.c.id.label("run_id"),
    *(_RUNS.c[name] for name in ("status", "fencing_token", "worker", "retracted", "goal", "pace")),
    _RUNS.c.answers.label("answered"),
    _asked(QueryStatus.OPEN, _QUERY.c.kind == "guidance").label("open_guidance"),
    _asked(QueryStatus.OPEN, _QUERY.c.kind == "preference").label("open_preferences"),
    _asked(QueryStatus.ANSWERED).label("answers"),
    _number(_EVENT.c.run_id == _RUNS.c.id, _EVENT.c.applied_tick.is_(None)).label("events"),
    _CORRECTIONS.label("corrections"),
    (_RUNS.c.parent == "human").label("person"),
).where(_RUNS.c.id.in_(bindparam("run_ids", expanding=True)))


def watch(db: Database, run_ids: Sequence[int]) -> dict[int, Watch]:
    """Return the state of some runs, by id. Until somebody commits, a second call costs almost nothing."""
    return db.cached(("watch", *run_ids), lambda: look(db, run_ids))


def look(db: Database, run_ids: Sequence[int]) -> dict[int, Watch]:
    """Return the state of some runs as it is now, by id."""
    with db.read() as session:
        return look_in(session, run_ids)


def look_in(session: Session, run_ids: Sequence[int]) -> dict[int, Watch]:
    """Return the state of some runs, by id, in an open transaction."""
    rows = session.execute(_WATCH, {"run_ids": run_ids}).all()
    seen = {row.run_id: _watched(dict(row._mapping)) for row in rows}
    return {run_id: seen[run_id] for run_id in run_ids if run_id in seen}


def _watched(columns: dict[str, Any]) -> Watch:
    """Return what a worker watches. A run whose row is damaged is over for it: `runs.claim` says why."""
    retracted = columns.pop("retracted")
    if isinstance(retracted, Damaged) or any(isinstance(value, Damaged) for value in columns.values()):
        sound: dict[str, Any] = {n: None if isinstance(v, Damaged) else v for n, v in columns.items()}
        return Watch(**{**sound, "status": RunStatus.FAILED, "fencing_token": -1, "answered": 0})
    return Watch(**{**columns, "answered": columns["answered"] - retracted})


def high_water(db: Database, run_id: int) -> int:
    """Return the largest tick of any posted query, applied answer or applied event; -1 without any."""
    with db.read() as session:
        return max(high(session, run_id))


def post_query(
    db: Database,
    mine: Claim,
    tick: int,
    kind: str,
    maturity: int,
    clips: dict[str, Any],
    policy: tuple[int, int] | None = None,
    votes: int = 0,
) -> int:
    """Insert the query of a tick and return its id. A tick that has one already keeps it.

    Args:
        db: The database.
        mine: The worker's claim on the run.
        tick: The tick in which the agent asks.
        kind: guidance or preference.
        maturity: The stage that the clips were recorded at.
        clips: The clips, as `server.codec.encode` writes them.
        policy: The policy that asks: its stage, and its gradient steps in that stage.
        votes: The answers heard before on the same pair of moves in the same pause.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write() as session:
        status = held_status(session, mine)
        known = session.execute(_KNOWN, {"run_id": mine.run_id, "tick": tick}).scalar()
        if known is not None:
            return int(known)
        stage, steps = policy or (None, None)
        number = unused_number(session, Query)
        asked = {
            "run_id": mine.run_id,
            "tick": tick,
            "kind": kind,
            "maturity": maturity,
            "clips": clips,
            "policy_stage": stage,
            "policy_steps": steps,
            "votes": votes,
            "posted": db.clock(),
            "status": QueryStatus.OPEN if status in LIVING else QueryStatus.WITHDRAWN,
        }
        if number is not None:
            asked["id"] = number
        stored: int = session.execute(_POSTED, asked).scalar_one()
        announce(session, "web", mine.run_id)
        return stored


def asked_at(db: Database, run_id: int, tick: int) -> Query | None:
    """Return the query of a tick, if there is one: a replayed tick has to ask the same."""
    with db.read() as session:
        return session.scalars(select(Query).where(Query.run_id == run_id, Query.tick == tick)).one_or_none()


def asked_before(db: Database, run_id: int, tick: int) -> int:
    """Return the number of questions that were asked before a tick."""
    with db.read() as session:
        asked = select(func.count()).where(Query.run_id == run_id, Query.tick < tick)
        return session.execute(asked).scalar_one()


def take_answer(db: Database, mine: Claim, tick: int, known: Collection[int] = ()) -> Taken | None:
    """Return the answer to be heard at this tick, or None: guidance first, then the oldest query's.

    A new answer is marked with the tick in the same transaction. On replay the recorded answer comes back,
    even if it was superseded later. A correction is heard by `take_correction` alone. This never waits, and
    it reads no clips of queries of `known` numbers.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write(durable=False) as session:
        if closed(session, mine.run_id, tick):
            found = recorded_at(session, mine.run_id, tick)
            return None if found is None or heard_before(session, found.answer) else found
        held_status(session, mine)
        found = _pending(session, mine.run_id, known)
        if found is not None:
            _hear(session, found, tick)
            db.outlive_crash(session)
        return found


def take_operator_events(db: Database, mine: Claim, tick: int) -> Sequence[OperatorEvent]:
    """Return the operator events that apply before this tick, in their order, and mark new ones with it.

    The event *end the episode* also withdraws the open guidance query, because nobody waits for that move any
    more, and the run no longer counts as stuck, so that nobody ends the next episode as well.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    mine_only = (
        select(OperatorEvent)
        .where(OperatorEvent.run_id == mine.run_id, OperatorEvent.kind.in_(AGENT_KINDS))
        .order_by(OperatorEvent.id)
    )
    recorded = mine_only.where(OperatorEvent.applied_tick == tick)
    fresh = mine_only.where(OperatorEvent.applied_tick.is_(None))
    with db.read() as session:
        if max(high(session, mine.run_id)) >= tick:
            return session.scalars(recorded).all()
        if session.scalars(fresh.limit(1)).first() is None:
            return []
    with db.write() as session:
        run = held(session, mine)
        events = session.scalars(fresh).all()
        for event in events:
            event.applied_tick = tick
        if any(event.kind == "end_episode" for event in events):
            withdraw_guidance_in(session, mine.run_id, tick)
            run.waiting = None
        return events


def _hear(session: Session, found: Taken, tick: int) -> None:
    session.execute(_HEARD[0], {"answer": found.answer.id, "tick": tick})
    session.execute(_HEARD[1], {"query": found.query.id})
    set_committed_value(found.answer, "applied_tick", tick)
    set_committed_value(found.query, "status", QueryStatus.APPLIED)


def _pending(session: Session, run_id: int, known: Collection[int]) -> Taken | None:
    found = None if (row := session.execute(_PENDING, {"run_id": run_id}).first()) is None else Taken(*row)
    if found is not None and found.query.id not in known:
        session.refresh(found.query, ["clips"])
    return found

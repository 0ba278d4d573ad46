"""The stored record of a run, for its replay: the events, answer and query of each tick, decoded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import torch
from pydantic import TypeAdapter
from sqlalchemy import select

from parenting.agent import query as queries
from parenting.agent.amendment import Correction
from parenting.agent.events import Event
from parenting.agent.query import Answer
from parenting.envs.gridworld import Gridworld
from parenting.parents.replay import Moment
from parenting.server import tables
from parenting.server.codec import CHOICES, decode
from parenting.server.db import Database
from parenting.server.notes import AGENT_KINDS
from parenting.server.queue.taken import heard_before, standing_at

WINDOW = 500
"""Ticks whose rows are read at once."""
_EVENTS: TypeAdapter[Event] = TypeAdapter(Event)


class UnreadableRecordError(ValueError):
    """The stored rows of a tick cannot be decoded."""


class StoredRecord:
    """The record of a run, by tick, read `WINDOW` ticks at a time, since a long one may be large."""

    def __init__(self, db: Database, run_id: int, world: Gridworld, stages: int) -> None:
        self.db, self.run_id, self.world, self.stages = db, run_id, world, stages
        self.answers = self.events = 0  # given back so far
        self.inherited: Sequence[Answer] = ()  # of an earlier run: corrections keep them in X
        self.nothing = queries.empty(1, stages, world.height, world.width)
        self._window = range(0)
        self._asked: dict[int, tables.Query] = {}
        self._heard: dict[int, tuple[tables.Answer, tables.Query]] = {}
        self._events: list[tables.OperatorEvent] = []

    def __call__(self, tick: int) -> Moment:
        """The moment of a tick.

        Raises:
            UnreadableRecordError: its rows are damaged.
        """
        if tick not in self._window:
            self._read(range(tick, tick + WINDOW))
        try:
            events, asked = list(self._events_of(tick)), self._query_of(tick)
            correction = self._correction_of(tick)
            if correction is not None:
                return Moment(events, queries.silence(self.nothing), asked, correction)
            return Moment(events, self._answer_of(tick), asked)
        except (LookupError, TypeError, ValueError) as error:
            raise UnreadableRecordError(f"The record of tick {tick} cannot be read: {error!r}.") from None

    def _read(self, window: range) -> None:
        first, last, mine = window[0], window[-1], self.run_id
        query, answer, event = tables.Query, tables.Answer, tables.OperatorEvent
        asked = select(query).where(query.run_id == mine, query.tick.between(first, last))
        heard = select(answer, query).join(query, answer.query_id == query.id)
        heard = heard.where(answer.run_id == mine, answer.applied_tick.between(first, last))
        came = select(event).where(event.run_id == mine, event.kind.in_(AGENT_KINDS))
        came = came.where(event.applied_tick.between(first, last))
        with self.db.read() as session:
            self._asked = {row.tick: row for row in session.scalars(asked)}
            self._heard = {row[0].applied_tick or 0: (row[0], row[1]) for row in session.execute(heard)}
            self._events = list(session.scalars(came.order_by(event.id)))
        self._window = window

    def _events_of(self, tick: int) -> Iterator[Event]:
        for row in self._events:
            if row.applied_tick == tick:
                self.events += 1
                yield _EVENTS.validate_python({"kind": row.kind, **row.payload})

    def _correction_of(self, tick: int) -> Correction | None:
        if tick not in self._heard:
            return None
        answer, query = self._heard[tick]
        with self.db.read() as session:
            replaced = heard_before(session, answer)
            standing = standing_at(session, self.run_id, tick) if replaced is not None else ()
        if replaced is None:
            return None
        self.answers += 1
        return Correction(
            self.in_tensors(answer, query),
            self.in_tensors(replaced, query),
            [*self.inherited, *(self.in_tensors(taken.answer, taken.query) for taken in standing)],
            query.tick,
        )

    def _answer_of(self, tick: int) -> Answer:
        if tick not in self._heard:
            return queries.silence(self.nothing)
        self.answers += 1
        return self.in_tensors(*self._heard[tick])

    def in_tensors(self, answer: tables.Answer, query: tables.Query) -> Answer:
        """Return a stored answer as the agent heard it."""
        choice = torch.tensor([int(CHOICES[answer.choice])])
        return Answer(query=self._decoded(query), choice=choice)

    def _query_of(self, tick: int) -> queries.Query:
        row = self._asked.get(tick)
        return self.nothing if row is None else self._decoded(row)

    def _decoded(self, row: tables.Query) -> queries.Query:
        return decode(self.world, self.stages, row.kind, row.maturity, row.clips, row.votes)

"""A stored run lived again from tick 0, from its answers and events, and held against its last checkpoint.

`parents.replay.ReplayParent` is the parent; here its record is read from the rows. All their SQL is here. It
writes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import torch
from pydantic import TypeAdapter
from sqlalchemy import select
from torch import Tensor

from parenting.agent import parenting
from parenting.agent import query as queries
from parenting.agent.config import Config
from parenting.agent.events import Event
from parenting.agent.init import world_of
from parenting.agent.query import Answer
from parenting.envs.gridworld import Gridworld
from parenting.parents.replay import Moment, ReplayMismatchError, ReplayParent
from parenting.server import tables
from parenting.server.codec import CHOICES, decode, kind_name
from parenting.server.counters import count
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.record import load_checkpoints
from parenting.server.runs import get_run
from parenting.server.snapshot import (
    INFO,
    DivergedError,
    Snapshot,
    initial_snapshot,
    initial_weights,
    unpack,
    versions,
)
from parenting.server.tables import Run

WINDOW = 500
"""Ticks whose rows are read at once."""
_EVENTS: TypeAdapter[Event] = TypeAdapter(Event)

Progress = Callable[[int, int], None]
"""Told, after every tick, which it was and which will be the last."""


def _silent(tick: int, last: int) -> None:
    """Tell nobody."""


@dataclass(frozen=True)
class Relived:
    """What came of a run's second life, up to its last intact checkpoint or to where the two lives part."""

    run: int
    tick: int  # the last one that was lived again
    answers: int
    events: int
    checkpoint: int  # the tick of the checkpoint
    parted: str | None = None  # a sentence: where the agent left its record
    differ: Sequence[str] = field(default_factory=tuple)  # pieces of state that are not equal bit for bit

    @property
    def equal(self) -> bool:
        """Whether every question was asked again, and every piece of state is equal bit for bit."""
        return self.parted is None and not self.differ


class UnreadableRecordError(ValueError):
    """What is stored of a tick cannot be what was written there."""


class Rows:
    """The record of a run, by tick; read some hundred ticks at a time, since a long one may be large."""

    def __init__(self, db: Database, run_id: int, world: Gridworld, stages: int) -> None:
        self.db, self.run_id, self.world, self.stages = db, run_id, world, stages
        self.answers = self.events = 0  # given back so far
        self.nothing = queries.empty(1, stages, world.height, world.width)
        self._window = range(0)
        self._asked: dict[int, tables.Query] = {}
        self._heard: dict[int, tuple[tables.Answer, tables.Query]] = {}
        self._events: list[tables.Event] = []

    def __call__(self, tick: int) -> Moment:
        """The moment of a tick.

        Raises:
            UnreadableRecordError: its rows are damaged.
        """
        if tick not in self._window:
            self._read(range(tick, tick + WINDOW))
        try:
            return Moment(list(self._events_of(tick)), self._answer_of(tick), self._query_of(tick))
        except (LookupError, TypeError, ValueError) as error:
            raise UnreadableRecordError(f"What is stored of tick {tick} cannot be read: {error!r}.") from None

    def _read(self, window: range) -> None:
        first, last, mine = window[0], window[-1], self.run_id
        query, answer, event = tables.Query, tables.Answer, tables.Event
        asked = select(query).where(query.run_id == mine, query.tick.between(first, last))
        heard = select(answer, query).join(query, answer.query_id == query.id)
        heard = heard.where(answer.run_id == mine, answer.applied_tick.between(first, last))
        came = select(event).where(event.run_id == mine, event.applied_tick.between(first, last))
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

    def _answer_of(self, tick: int) -> Answer:
        if tick not in self._heard:
            return queries.silence(self.nothing)
        self.answers += 1
        answer, query = self._heard[tick]
        choice = torch.tensor([int(CHOICES[answer.choice])])
        return Answer(query=self._decoded(query), choice=choice)

    def _query_of(self, tick: int) -> queries.Query:
        row = self._asked.get(tick)
        return self.nothing if row is None else self._decoded(row)

    def _decoded(self, row: tables.Query) -> queries.Query:
        return decode(self.world, self.stages, row.kind, row.maturity, row.clips)


def relive(db: Database, run_id: int, progress: Progress = _silent) -> Relived:
    """Live a run again from tick 0 to its last intact checkpoint, and compare every piece of state with it.

    A run that is being raised may be lived again, too: up to its last checkpoint nothing changes any more.

    Raises:
        NotFound: there is no such run, or no intact checkpoint of it.
        DivergedError: it was raised by another build of torch or with other threads, so that the bits would
            differ; or its checkpoint does not fit its config.
    """
    run = get_run(db, run_id)
    config = Config.model_validate(run.config)
    world = world_of(run.world, run.level_text, config)
    weights = initial_weights(db, run, world)
    kept = _checkpoint(db, run, world, config, weights)
    last, rows = int(kept.state.keys.tick[0]), Rows(db, run_id, world, config.stages)
    lived, parent, parted = initial_snapshot(world, config, run.seed, weights), ReplayParent(rows), None
    try:
        for tick in range(1, last + 1):
            lived = _beat(world, lived, parent)
            progress(tick, last)
    except (ReplayMismatchError, UnreadableRecordError) as error:
        parted = _said(error) if isinstance(error, ReplayMismatchError) else str(error)
    differ = () if parted else differences(lived, kept)
    return Relived(run_id, parent.tick, rows.answers, rows.events, last, parted, differ)


def _beat(world: Gridworld, saved: Snapshot, parent: ReplayParent) -> Snapshot:
    state, config, _ = parenting.tick(world, saved.config, saved.state, parent)
    return Snapshot(state, count(world, saved.tally, parent.now.answer, state), config)


def _checkpoint(db: Database, run: Run, world: Gridworld, config: Config, weights: Tensor | None) -> Snapshot:
    found = load_checkpoints(db, run.id)
    intact = [checkpoint for checkpoint in found if checkpoint.intact]
    if not intact:
        raise NotFound(
            f"Every checkpoint of run {run.id} is damaged: there is nothing to compare its record with."
            if found
            else f"Run {run.id} has no checkpoint yet: a worker writes one every two seconds of its life."
        )
    _same_build(run)
    try:
        return unpack(world, config, intact[0].blob, weights)
    except (TypeError, KeyError) as error:
        raise DivergedError(f"The checkpoint of run {run.id} does not fit its config: {error}.") from None


def _same_build(run: Run) -> None:
    here, there = versions(), run.versions or versions()
    if here != there:
        raise DivergedError(
            f"Run {run.id} was raised with torch {there['torch']} and {_threads(there['threads'])}; here are "
            f"torch {here['torch']} and {_threads(here['threads'])}, which give other bits. "
            f"Install torch {there['torch']} to replay it."
        )


def _threads(number: int) -> str:
    return f"{number} thread{'' if number == 1 else 's'}"


def _said(parted: ReplayMismatchError) -> str:
    recorded, asked = kind_name(parted.recorded), kind_name(parted.asked)
    if recorded is None:
        return f"At tick {parted.tick} it asks for {asked}; the record has no question there."
    if asked is None:
        return f"At tick {parted.tick} it asks nothing; the record has a question of {recorded} there."
    return f"At tick {parted.tick} it asks another question of {asked} than the record has there."


def differences(one: Snapshot, other: Snapshot) -> list[str]:
    """The names of the pieces of state that are not equal bit for bit; the report is none."""
    wrong = [] if one.config == other.config else ["config"]
    for prefix, ours, theirs in (("", one.state, other.state), ("tally.", one.tally, other.tally)):
        expected = theirs.tensors()
        wrong += [
            prefix + name
            for name, part in ours.tensors().items()
            if not name.startswith(INFO) and not equal(part, expected[name])
        ]
    return wrong


def equal(one: Tensor, other: Tensor) -> bool:
    """Bit for bit, shape and dtype included: 0.0 and -0.0 are two, and a NaN equals itself."""
    if one.dtype != other.dtype or one.shape != other.shape:
        return False
    return torch.equal(_bytes(one), _bytes(other))


def _bytes(tensor: Tensor) -> Tensor:
    return tensor.contiguous().reshape(-1).view(torch.uint8)

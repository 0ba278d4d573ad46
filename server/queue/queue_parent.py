"""QueueParent: a parent behind the database. People answer in the browser, or a script for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy
from typing import Self

import torch
from pydantic import TypeAdapter

from parenting.agent import amendment
from parenting.agent import query as queries
from parenting.agent.amendment import Correction, TickEvent
from parenting.agent.config import Config
from parenting.agent.events import Event
from parenting.agent.query import Answer, Query
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Keys
from parenting.parents.fallible import FallibleRule
from parenting.server import tables
from parenting.server.answer_tables import SCRIPT
from parenting.server.codec import CHOICE_NAMES, CHOICES, decode, encode, kind_name
from parenting.server.damage import readable, reading, sound
from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.queue import answers, corrections, skips, worker_side
from parenting.server.queue.known import Known
from parenting.server.queue.repairs import repair
from parenting.server.runs import Claim

_EVENTS: TypeAdapter[Event] = TypeAdapter(Event)


class QueueParent:
    """Answers and the operator's events come from rows, and queries go into rows. The tick names them all."""

    def __init__(
        self, db: Database, mine: Claim, world: Gridworld, config: Config, asked: Callable[[], None]
    ) -> None:
        """A mailbox for the run of a claim; `asked` is called once a query is stored: pages wake."""
        self.db, self.mine, self.world, self.asked = db, mine, world, asked
        self.stages = config.max_clip_length
        self.tick = 0
        self.keys: Keys | None = None  # before this tick
        self.policy = (1, 0)
        self.answers = self.events_wait = True
        self.corrected: amendment.Applied | None = None  # heard in this tick
        self.inherited: Sequence[Answer] = ()  # of an earlier run: corrections keep them in X
        self.known = Known()
        self.record_ends = -1  # the last tick of the record: up to it, recorded questions stand
        self.follow_until = -1  # the last tick whose record another machine has written

    def looking(self, answers: bool, events: bool) -> Self:
        """Return the same mailbox for one tick; it reads no rows where there are known to be none."""
        mailbox = copy(self)
        mailbox.answers, mailbox.events_wait = answers, events
        return mailbox

    def events(self, state: AgentState) -> Sequence[TickEvent]:
        """The operator's events and the correction that apply before the tick that comes."""
        self.keys, self.tick = state.keys, int(state.keys.tick[0]) + 1
        if not self.events_wait:
            return []
        rows = worker_side.take_operator_events(self.db, self.mine, self.tick)
        events = [_EVENTS.validate_python({"kind": row.kind, **readable(row).payload}) for row in rows]
        found = corrections.take_correction(self.db, self.mine, self.tick)
        if found is None:
            return events
        self.corrected = amendment.take(state, events, self._correction(found))
        if self.corrected.heard is not None:
            corrections.withdraw_guidance(self.db, self.mine, self.tick)
        return [*events, self.corrected.event]

    def _correction(self, found: corrections.Corrected) -> Correction:
        return Correction(
            self.in_tensors(found.answer, found.query),
            self.in_tensors(found.replaced, found.query),
            [*self.inherited, *(self.in_tensors(taken.answer, taken.query) for taken in found.standing)],
            found.query.tick,
        )

    def in_tensors(self, row: tables.Answer, query: tables.Query) -> Answer:
        """Return a stored answer as the agent hears it."""
        choice = int(CHOICES[readable(row).choice])
        known = self.known.forget(query.id)
        return Answer(query=self.read(query) if known is None else known, choice=torch.tensor([choice]))

    def take(self, state: AgentState) -> Answer:
        """The answer to be heard in the tick that comes, or none."""
        self.policy = int(state.maturity[0]), int(state.learner.steps[0])
        if self.corrected is not None and self.corrected.heard is not None:
            return self.corrected.heard
        asking = self.answers and self.corrected is None
        known = self.known
        taken = worker_side.take_answer(self.db, self.mine, self.tick, known.numbers()) if asking else None
        if taken is None:
            return queries.silence(queries.empty(1, self.stages, self.world.height, self.world.width))
        return self.in_tensors(taken.answer, taken.query)

    def post(self, query: Query) -> None:
        """Store what the agent asks in this tick; a tick that was lived before asks nothing twice."""
        if self.tick <= self.record_ends:
            stored = worker_side.asked_at(self.db, self.mine.run_id, self.tick)
            if stored is not None:
                self.posted(stored.id, self.read(self._repaired(stored, query)))
            if stored is not None or self.tick < self.record_ends:
                return
        kind = kind_name(query)
        if kind is not None:
            number = worker_side.post_query(
                self.db,
                self.mine,
                self.tick,
                kind,
                int(query.maturity[0]),
                encode(self.world, query),
                self.policy,
                int(query.votes[0]),
            )
            self.known.keep(number, query)
            self.posted(number, query)
            self.asked()

    def _repaired(self, stored: tables.Query, query: Query) -> tables.Query:
        """Return the question of a replayed tick; damaged clips are written again where that is proved."""
        kind = kind_name(query)
        if kind is None:
            return stored
        asked = {
            "kind": kind,
            "maturity": int(query.maturity[0]),
            "votes": int(query.votes[0]),
            "clips": encode(self.world, query),
        }
        if asked == {name: sound(stored, name) for name in asked}:
            return stored
        same_machine = self.tick > self.follow_until
        return repair(self.db, self.mine, stored, asked, same_machine) or stored

    def read(self, row: tables.Query) -> Query:
        """Return a stored query in tensors.

        Raises:
            DamagedRowError: its row cannot be read.
        """
        with reading(row):
            return decode(self.world, self.stages, row.kind, row.maturity, row.clips, row.votes)

    def posted(self, number: int, query: Query) -> None:
        """A query of this id is stored: somebody will see it."""


class ScriptedQueueParent(QueueParent):
    """A script behind the same rows: it answers each query as soon as it is stored."""

    def __init__(
        self,
        db: Database,
        mine: Claim,
        world: Gridworld,
        config: Config,
        asked: Callable[[], None],
        rule: FallibleRule,
    ) -> None:
        """A mailbox that is answered by `rule`."""
        super().__init__(db, mine, world, config, asked)
        self.rule = rule

    def posted(self, number: int, query: Query) -> None:
        """Store the script's answer or skip. A replayed tick stores the same again, which changes nothing."""
        choice = CHOICE_NAMES[self._choice(query)]
        with suppress(Conflict):  # the operator has stopped the run meanwhile: the question was withdrawn
            if choice == tables.SKIP:
                skips.skip(self.db, number, SCRIPT, SCRIPT, final=True)
            else:
                answers.answer(self.db, number, choice, SCRIPT, SCRIPT)

    def _choice(self, query: Query) -> int:
        """Return the answer of the parent in tensors, who counts what it was asked before."""
        assert self.keys is not None, "a question is asked after the tick began"
        before = worker_side.asked_before(self.db, self.mine.run_id, self.tick) if self.rule.spec.errs else 0
        return int(self.rule.answer(query, self.keys.next(), torch.tensor([before]))[0])

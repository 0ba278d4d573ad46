"""QueueParent: a parent behind the database. People answer in the browser, or a script for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress

import torch
from pydantic import TypeAdapter

from parenting.agent import query as queries
from parenting.agent.config import Config
from parenting.agent.events import Event
from parenting.agent.query import Answer, Query
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.parents.scripted import ScriptedRule
from parenting.server.codec import CHOICE_NAMES, CHOICES, decode, encode, kind_name
from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.queue import answers, worker_side
from parenting.server.runs import Claim

SCRIPT = "scripted"
_EVENTS: TypeAdapter[Event] = TypeAdapter(Event)


class QueueParent:
    """Answers and the operator's events come from rows, and queries go into rows. The tick names them all."""

    def __init__(
        self, db: Database, mine: Claim, world: Gridworld, config: Config, asked: Callable[[], None]
    ) -> None:
        """A mailbox for the run of a claim; `asked` is called once a query is stored: pages wake."""
        self.db, self.mine, self.world, self.asked = db, mine, world, asked
        self.stages = config.stages
        self.tick = 0
        self.policy = (1, 0)
        self.heard: Answer | None = None
        self.answers = self.events_wait = True

    def expect(self, answers: bool, events: bool) -> None:
        """Whether the next tick has to look for answers and events; who has just looked spares it the way."""
        self.answers, self.events_wait = answers, events

    def events(self, state: AgentState) -> Sequence[Event]:
        """The operator's events that apply before the tick that comes."""
        self.tick = int(state.keys.tick[0]) + 1
        rows = worker_side.take_operator_events(self.db, self.mine, self.tick) if self.events_wait else ()
        return [_EVENTS.validate_python({"kind": row.kind, **row.payload}) for row in rows]

    def take(self, state: AgentState) -> Answer:
        """The answer to be heard in the tick that comes, or none."""
        self.policy = int(state.maturity[0]), int(state.learner.steps[0])
        taken = worker_side.take_answer(self.db, self.mine, self.tick) if self.answers else None
        if taken is None:
            nothing = queries.empty(1, self.stages, self.world.height, self.world.width)
            self.heard = queries.silence(nothing)
        else:
            row = taken.query
            query = decode(self.world, self.stages, row.kind, row.maturity, row.clips)
            choice = torch.full_like(query.kind, int(CHOICES[taken.answer.choice]))
            self.heard = Answer(query=query, choice=choice)
        return self.heard

    def post(self, query: Query) -> None:
        """Store what the agent asks in this tick; a tick that was lived before asks nothing twice."""
        kind = kind_name(query)
        if kind is not None:
            clips, maturity = encode(self.world, query), int(query.maturity[0])
            number = worker_side.post_query(self.db, self.mine, self.tick, kind, maturity, clips, self.policy)
            self.posted(number, query)
            self.asked()

    def posted(self, number: int, query: Query) -> None:
        """A query of this id is stored: somebody will see it."""


class ScriptedQueueParent(QueueParent):
    """The scripted parent behind the same rows: it answers each query as soon as it is stored."""

    def __init__(
        self,
        db: Database,
        mine: Claim,
        world: Gridworld,
        config: Config,
        asked: Callable[[], None],
        rule: ScriptedRule,
    ) -> None:
        """A mailbox that is answered by `rule`."""
        super().__init__(db, mine, world, config, asked)
        self.rule = rule

    def posted(self, number: int, query: Query) -> None:
        """Store the script's answer. A replayed tick stores the same again, which changes nothing."""
        choice = CHOICE_NAMES[int(self.rule.answer(query)[0])]
        with suppress(Conflict):  # the operator has stopped the run meanwhile: the question was withdrawn
            answers.answer(self.db, number, choice, SCRIPT, SCRIPT)

"""A tick with its parent (Sec. 2): what it asks of the parent, in which order, and what it returns."""

from __future__ import annotations

from collections.abc import Sequence

import torch

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.events import Change, Event
from parenting.agent.query import Answer, Query, QueryKind
from parenting.agent.state import AgentState
from parenting.envs import registry
from parenting.envs.rng import keys
from parenting.parents.scripted import ScriptedParent
from tests.agent.batched_runs import Judged, random_parent

WORLD = registry.make("unsafe-exploration")
CONFIG = Config(p_guid=0.9, p_rec=0.9, p_pref=0.9)


class Watched(ScriptedParent):
    """Notes every verb that a tick calls, and lets the operator change p_rec before the second one."""

    def __init__(self, state: AgentState) -> None:
        super().__init__(Judged(random_parent), parenting.no_query(WORLD, CONFIG, state))
        self.called: list[str] = []
        self.taken: Answer
        self.posted: Query

    def events(self, state: AgentState) -> Sequence[Event]:
        self.called.append("events")
        return [Change(name="p_rec", value=0.0)] if int(state.keys.tick[0]) == 1 else []

    def take(self, state: AgentState) -> Answer:
        self.called.append("take")
        self.taken = super().take(state)
        return self.taken

    def post(self, query: Query) -> None:
        self.called.append("post")
        self.posted = query
        super().post(query)


def test_a_tick_returns_the_answer_that_it_took_and_the_query_that_it_posted() -> None:
    state = parenting.init(WORLD, CONFIG, keys(0, 4))
    parent, config, kinds = Watched(state), CONFIG, set[int]()
    for _ in range(30):
        parent.called.clear()
        state, query, answer, config, _ = parenting.tick(WORLD, config, state, parent)
        assert parent.called == ["events", "take", "post"]
        assert answer is parent.taken
        assert query is parent.posted
        kinds |= set(answer.query.kind.tolist())
    assert {QueryKind.NONE, QueryKind.GUIDANCE} <= kinds


def test_the_operators_events_apply_before_the_step_and_stay() -> None:
    state = parenting.init(WORLD, CONFIG, keys(0, 4))
    parent, config = Watched(state), CONFIG
    found = []
    for _ in range(4):
        state, _, _, config, _ = parenting.tick(WORLD, config, state, parent)
        found.append(config.p_rec)
    assert found == [0.9, 0.0, 0.0, 0.0]


def test_a_tick_is_a_step_on_the_answer_that_it_returns() -> None:
    state = parenting.init(WORLD, CONFIG, keys(3, 4))
    parent = ScriptedParent(Judged(random_parent), parenting.no_query(WORLD, CONFIG, state))
    for _ in range(20):
        before = state.clone()
        state, query, answer, config, _ = parenting.tick(WORLD, CONFIG, state, parent)
        after, asked = parenting.step(WORLD, CONFIG, before, answer)
        assert config is CONFIG
        theirs = {**after.tensors(), **{f"query.{name}": part for name, part in asked.tensors().items()}}
        ours = {**state.tensors(), **{f"query.{name}": part for name, part in query.tensors().items()}}
        assert [name for name, part in ours.items() if not torch.equal(part, theirs[name])] == []

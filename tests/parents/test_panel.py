"""A panel of parents: what it answers, and what it remembers of whom."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
import torch
from torch import Tensor

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.events import Event
from parenting.agent.query import Answer, Choice, Query
from parenting.agent.state import AgentState
from parenting.envs.rng import keys
from parenting.experiments.training.batch import train_agents
from parenting.experiments.training.stop_rule import StopRule
from parenting.parents.consensus import majority, trusted
from parenting.parents.panel import Panel, policy_opinion
from parenting.parents.scripted import ScriptedParent, ScriptedRule
from tests.parents.walked_queries import island

N = Choice.NONE


class Reciting:
    """Answers from a list, a choice a trial and tick, and shows what keys it was given."""

    def __init__(self, *ticks: Sequence[Choice]) -> None:
        self.ticks, self.seeds = [torch.tensor(tick) for tick in ticks], list[Tensor]()
        self.query: Query

    def take(self, state: AgentState) -> Answer:
        self.seeds.append(state.keys.seed)
        return Answer(query=self.query, choice=self.ticks.pop(0))

    def post(self, query: Query) -> None:
        self.query = query

    def events(self, state: AgentState) -> Sequence[Event]:
        return ()

    def pick(self, index: Tensor) -> None:
        self.ticks = [tick[index] for tick in self.ticks]
        self.query = self.query.pick(index)


def told(members: Sequence[Reciting], consensus: object = majority) -> list[list[int]]:
    """The answers of a panel in each tick, to two trials that ask wherever somebody answers."""
    world, config = island(), Config()
    state = parenting.init(world, config, keys(0, 2))
    query = parenting.no_query(world, config, state)
    panel = Panel(members, consensus, query)  # type: ignore[arg-type]  # one of consensus.py
    answers = []
    while members[0].ticks:
        kind = torch.stack([member.ticks[0] for member in members]).max(0).values.clamp_max(1)
        panel.post(query.replace(kind=kind))
        answers.append(panel.take(state).choice.tolist())
    return answers


def test_most_votes_decide_skips_do_not_count_and_a_skip_by_all_is_one() -> None:
    left, right, neither, skip = Choice.LEFT, Choice.RIGHT, Choice.NEITHER, Choice.SKIP
    one = Reciting([left, N], [skip, right], [skip, skip], [N, N])
    two = Reciting([right, N], [right, skip], [skip, neither], [N, N])
    three = Reciting([left, N], [right, skip], [skip, skip], [N, N])
    assert told([one, two, three]) == [[left, N], [right, right], [skip, neither], [N, N]]


def test_whoever_contradicted_the_others_before_is_outvoted_in_the_first_trial_alone() -> None:
    left, right = Choice.LEFT, Choice.RIGHT
    before = 20
    good, other = [[left, left]] * before, [[right, left]] * before
    members = [Reciting(*(good if who < 3 else other), [left if who < 2 else right] * 2) for who in range(5)]
    *_, last = told(members, trusted)
    assert last == [left, right]


def test_no_two_members_err_by_the_same_draws() -> None:
    members = [Reciting([Choice.LEFT, N]) for _ in range(3)]
    told(members)
    seeds = torch.stack([member.seeds[0] for member in members])
    assert len(set(seeds.flatten().tolist())) == 6
    assert torch.equal(members[0].seeds[0], keys(0, 2).seed)


def test_a_panel_of_perfect_parents_raises_the_agents_that_one_of_them_raises() -> None:
    """Bit for bit, although trials leave the batch meanwhile."""
    world, config = island(), Config(p_guid=0.95)

    def three(scripted: ScriptedParent, _done: object) -> Panel:
        rule = ScriptedRule(world, config.gamma)
        members = [ScriptedParent(rule, scripted.query) for _ in range(3)]
        return Panel(members, trusted, scripted.query, policy_opinion(world))

    alone, together = (
        train_agents(world, config, keys(5, 12), StopRule("queries", 6), max_ticks=40, parent=parent)
        for parent in (None, three)
    )
    assert torch.equal(alone.policies, together.policies)


def test_a_panel_of_nobody_is_refused() -> None:
    world, config = island(), Config()
    query = parenting.no_query(world, config, parenting.init(world, config, keys(0, 1)))
    with pytest.raises(ValueError, match="at least one parent"):
        Panel([], majority, query)

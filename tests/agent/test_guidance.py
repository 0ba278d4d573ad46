"""Guidance (Sec. 2.1): when the agent pauses, what it asks, and how a pause ends."""

from __future__ import annotations

import pytest
import torch

from parenting.agent import parenting
from parenting.agent.config import PRESETS, Config
from parenting.agent.events import EndEpisode
from parenting.agent.familiarity import ask_chance
from parenting.agent.policy import Network
from parenting.agent.query import Answer, Choice, Query, QueryKind, silence
from parenting.agent.state import AgentState
from parenting.envs import registry
from parenting.envs.rng import Stream, keys
from tests.agent.batched_runs import random_parent, run_batch

WORLD = registry.make("unsafe-exploration", time_limit=25)
ALWAYS = Config(p_guid=1, p_rec=0, p_pref=0, p_train=0, max_episode_steps=25)
TRIALS = 8


def say(state: AgentState, query: Query, choice: Choice) -> tuple[AgentState, Query]:
    return parenting.step(
        WORLD, ALWAYS, state, Answer(query=query, choice=torch.full_like(query.kind, choice))
    )


def hush(state: AgentState, query: Query) -> tuple[AgentState, Query]:
    return parenting.step(WORLD, ALWAYS, state, silence(query))


def paused() -> tuple[AgentState, Query]:
    """Agents one approved move into their first episode that have just asked again."""
    state = parenting.init(WORLD, ALWAYS, keys(1, TRIALS))
    state, query = hush(state, parenting.no_query(WORLD, ALWAYS, state))
    state, query = say(state, query, Choice.LEFT)
    assert state.world.step_count.tolist() == [1] * TRIALS
    state.familiarity.zero_()
    state, query = hush(state, query)
    assert state.world.step_count.tolist() == [1] * TRIALS
    assert query.kind.tolist() == [QueryKind.GUIDANCE] * TRIALS
    return state, query


def test_chance_by_hand() -> None:
    f = torch.tensor([0, 1, 2, 3])
    assert ask_chance(f, 0.5).tolist() == [1, 0.5, 0.25, 0.125]
    assert ask_chance(f, 0.95).tolist() == pytest.approx([1, 0.95, 0.9025, 0.857375])
    assert ask_chance(f, 1).tolist() == [1, 1, 1, 1]
    assert ask_chance(f, 0).tolist() == [0, 0, 0, 0]


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("f", [0, 1, 3])
def test_the_agent_asks_with_that_chance(f: int) -> None:
    trials = 500
    config = Config(p_guid=0.5, max_episode_steps=25)
    state = parenting.init(WORLD, config, keys(2, trials))
    state.familiarity.fill_(f)
    expected = state.keys.next().uniform(Stream.ASK) < 0.5**f
    _, query = parenting.step(WORLD, config, state, silence(parenting.no_query(WORLD, config, state)))
    assert torch.equal(query.kind == QueryKind.GUIDANCE, expected)
    assert abs(int(expected.sum()) - trials * 0.5**f) <= 50  # more than four standard deviations


def test_p_guid_0_never_asks() -> None:
    config = Config.model_validate({**PRESETS["direct"], "time_limit": 25})
    state, logs = run_batch(WORLD, config, random_parent, seed=4, trials=4, ticks=150)
    assert {kind for log in logs for _, kind, _, _ in log} == {"preference"}
    assert int(state.familiarity.sum()) == 0


def test_nothing_moves_while_no_answer_comes() -> None:
    state, query = paused()
    agent = state.world.agent.clone()
    for _ in range(5):
        state, nothing = hush(state, query)
        assert not bool(nothing.kind.any())
    assert state.waiting.all()
    assert torch.equal(state.world.agent, agent)
    assert state.world.step_count.tolist() == [1] * TRIALS


@pytest.mark.parametrize("choice", [Choice.LEFT, Choice.RIGHT, Choice.EITHER])
def test_an_approved_action_is_performed(choice: Choice) -> None:
    state, query = paused()
    sides = query.action[:, :, 0]
    heads = state.keys.next().uniform(Stream.EITHER) < 0.5
    assert set(heads.tolist()) == {False, True}
    left = heads if choice == Choice.EITHER else torch.full_like(heads, choice == Choice.LEFT)
    state, _ = say(state, query, choice)
    assert torch.equal(state.info.action, torch.where(left, sides[:, 0], sides[:, 1]))
    assert state.info.moved.all()
    assert state.world.step_count.tolist() == [2] * TRIALS
    assert not bool(state.waiting.any())
    assert state.x.size.tolist() == [2] * TRIALS


def test_neither_redraws_the_other_two_in_the_same_tick_and_stores_nothing() -> None:
    state, first = paused()
    size, mu = state.x.size.clone(), state.x.mu.clone()
    tick = state.keys.tick.clone()
    state, second = say(state, first, Choice.NEITHER)
    assert torch.equal(state.keys.tick, tick + 1)
    assert second.kind.tolist() == [QueryKind.GUIDANCE] * TRIALS
    offered = torch.cat((first.action[:, :, 0], second.action[:, :, 0]), 1)
    assert offered.sort(1).values.tolist() == [[0, 1, 2, 3]] * TRIALS
    assert state.familiarity.sum(1).tolist() == [2] * TRIALS  # the redraw counts
    assert state.familiarity.max(1).values.tolist() == [2] * TRIALS  # both in the same l(s)
    assert not bool(state.all_refused.any())
    assert torch.equal(state.x.size, size)
    assert torch.equal(state.x.mu, mu)
    state, third = say(state, second, Choice.NEITHER)
    assert not bool(third.kind.any())
    assert state.all_refused.all()
    assert torch.equal(state.x.size, size)
    assert state.familiarity.sum(1).tolist() == [2] * TRIALS
    assert not bool(state.info.moved.any())


def test_the_redrawn_question_can_be_approved() -> None:
    state, query = paused()
    state, query = say(state, query, Choice.NEITHER)
    state, _ = say(state, query, Choice.RIGHT)
    assert torch.equal(state.info.action, query.action[:, 1, 0])
    assert not bool(state.refused.any())
    assert not bool(state.waiting.any())


def test_end_episode_frees_the_stuck() -> None:
    state, query = paused()
    for _ in range(2):
        state, query = say(state, query, Choice.NEITHER)
    for _ in range(3):
        state, query = hush(state, query)
        assert not bool(query.kind.any())
    assert state.all_refused.all()
    assert state.world.step_count.tolist() == [1] * TRIALS
    state, _ = parenting.apply(WORLD, ALWAYS, state, EndEpisode())
    assert not bool(state.all_refused.any())
    state, query = hush(state, query)
    start = WORLD.reset(state.keys, state.world.level)
    assert state.world.step_count.tolist() == [0] * TRIALS
    assert torch.equal(state.world.agent, start.agent)
    assert query.kind.tolist() == [QueryKind.GUIDANCE] * TRIALS  # the new episode's own first question
    assert not bool(state.refused.any())


def test_nobody_asks_the_policy_while_every_agent_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    logits = Network.logits

    def counted(network: Network, *state: torch.Tensor) -> torch.Tensor:
        asked.append(len(state[0]))
        return logits(network, *state)

    monkeypatch.setattr(Network, "logits", counted)
    state, query = parenting.step(WORLD, ALWAYS, *start())
    assert asked == [TRIALS]
    for _ in range(3):
        state, _ = hush(state, query)
    assert asked == [TRIALS]
    state, _ = say(state, query, Choice.LEFT)  # the approved move: the policy is not asked for it, either
    assert asked == [TRIALS]


def start() -> tuple[AgentState, Answer]:
    state = parenting.init(WORLD, ALWAYS, keys(0, TRIALS))
    return state, silence(parenting.no_query(WORLD, ALWAYS, state))

"""Maturation (Sec. 2.4): what a stage leaves behind, and how clips of two steps act (Eq. 5, 6)."""

from __future__ import annotations

import torch
from torch import Tensor

from parenting.agent import parenting
from parenting.agent.config import PRESETS, Config
from parenting.agent.events import Mature
from parenting.agent.init import network_of
from parenting.agent.pairing import EXPLOIT, EXPLORE
from parenting.agent.query import Answer, Choice, Query, QueryKind, silence
from parenting.agent.state import AgentState
from parenting.envs import registry
from parenting.envs.rng import keys
from tests.agent.batched_runs import run_batch

WORLD = registry.make("unsafe-exploration", time_limit=25)
LAX = Config.model_validate({**PRESETS["lax"], "stages": 2, "time_limit": 25})


def agreeable(query: Query) -> Tensor:
    """Always *left*: nobody gets stuck."""
    return (query.kind != QueryKind.NONE).long() * Choice.LEFT


def mature(config: Config, state: AgentState) -> AgentState:
    """The operator's event, on a copy, so that before and after can be compared."""
    after, same = parenting.apply(WORLD, config, state.clone(), Mature())
    assert same == config
    return after.check()


def test_a_stage_ends() -> None:
    before, _ = run_batch(WORLD, LAX, agreeable, seed=5, trials=3, ticks=80)
    recorder = before.recorder
    assert bool((before.learner.steps > 0).all())
    assert bool((before.answered > 0).all())
    assert bool(recorder.ring.stored.flatten(1).any(1).all())
    after = mature(LAX, before)
    assert after.maturity.tolist() == [2, 2, 2]
    assert after.answered.tolist() == [0, 0, 0]
    # pi_1 is frozen, pi_2 begins as its copy, Adam's moments are reset
    assert torch.equal(after.learner.frozen[0], before.learner.params)
    assert torch.equal(after.learner.params, before.learner.params)
    assert not bool(after.learner.exp_avg.any() | after.learner.exp_avg_sq.any() | after.learner.steps.any())
    # the recorder is empty; what was asked, X and familiarity stay
    assert not bool(after.recorder.ring.stored.any() | after.recorder.ring.searchable.any())
    assert not bool(after.recorder.ring.count.any() | after.recorder.running.any())
    assert after.recorder.next_kind.tolist() == [EXPLOIT] * 3
    assert torch.equal(after.recorder.asked.pair, recorder.asked.pair)
    assert torch.equal(after.x.mu, before.x.mu)
    assert torch.equal(after.familiarity, before.familiarity)


def test_the_frozen_policy_stays_as_it_was() -> None:
    state, _ = run_batch(WORLD, LAX, agreeable, seed=5, trials=2, ticks=80)
    state = mature(LAX, state)
    frozen = state.learner.frozen.clone()
    assert torch.equal(frozen[0], state.learner.params)
    query = parenting.no_query(WORLD, LAX, state)
    for _ in range(30):
        state, query = parenting.step(WORLD, LAX, state, Answer(query=query, choice=agreeable(query)))
    assert bool((state.learner.steps > 0).any())
    assert torch.equal(state.learner.frozen, frozen)
    assert not torch.equal(state.learner.params, frozen[0])


def test_the_last_stage_never_ends() -> None:
    state, _ = run_batch(
        WORLD, LAX.model_copy(update={"max_clip_length": 1}), agreeable, seed=5, trials=2, ticks=60
    )
    after = mature(LAX.model_copy(update={"max_clip_length": 1}), state)
    for (name, ours), theirs in zip(state.tensors().items(), after.tensors().values(), strict=True):
        assert torch.equal(ours, theirs), name


def test_the_budget_of_answers_ends_a_stage() -> None:
    config = LAX.model_copy(update={"max_clip_length": 3, "queries_per_stage": 5})
    state = parenting.init(WORLD, config, keys(1, 3))
    for answered, stage, left in [(4, 1, 4), (5, 2, 0), (4, 2, 4), (9, 3, 0), (100, 3, 100)]:
        state.answered.fill_(answered)
        state, _ = parenting.step(WORLD, config, state, silence(parenting.no_query(WORLD, config, state)))
        assert state.maturity.tolist() == [stage] * 3
        assert state.answered.tolist() == [left] * 3


def prefers(state: AgentState, action: int) -> None:
    """A policy that has this argmax everywhere: no weights, and one bias in each head."""
    network = network_of(WORLD)
    state.learner.params.zero_()
    for layer in (network.layers[1], network.layers[-1]):
        state.learner.params[:, layer.bias + action] = 1


def test_the_second_action_of_a_clip_of_two_is_pi_1s() -> None:
    config = Config(p_guid=0, p_rec=1, p_pref=0, p_train=0, max_clip_length=2, max_episode_steps=25)
    state = parenting.init(WORLD, config, keys(3, 4))
    prefers(state, 3)
    state = mature(config, state)
    prefers(state, 1)
    for _ in range(60):
        state, _ = parenting.step(WORLD, config, state, silence(parenting.no_query(WORLD, config, state)))
    ring = state.recorder.ring
    for kind, first in ((EXPLOIT, [1]), (EXPLORE, [0, 2, 3])):  # Eq. (4): anything but the argmax
        here = ring.stored[:, kind]
        action, length = ring.action[:, kind][here], ring.length[:, kind][here]
        assert sorted(set(action[:, 0].tolist())) == first
        assert set(action[length == 2, 1].tolist()) == {3}
        assert int((length == 2).sum()) > 20
        assert int(length.max()) == 2

"""Sec. 4.2: preferences fix a reward only up to a shift, and a shift can make harm optimal.

`rho` gives +1 at the goal, -1 for the push that leaves the box stuck and 0 otherwise; `sigma` = rho - 1. The
two agree on every pair of clips of equal length. A finished episode rests in its end: there a clip of fixed
length goes on to earn the shift alone. So no preference tells them apart, and a reward model that is fitted
to preferences may be either. Its planner does harm under one of them. A parented agent plans with no reward
at all: what it learns is a function of the answers, which are the same.

So it is with a parent who compares advantages (Eq. 7), if life goes on at an end and gamma < 1: r + c then
adds c / (1 - gamma) to V_p and to Q_p everywhere, and nothing to Q_p - V_p, for clips of any length.
It is not so where V_p of a finished state is 0, as in our episodes: r + c adds c for each step that pi_p has
still to go, so it says how much time matters. That is another task, not another way to say the same.
"""

from __future__ import annotations

import pytest
import torch

from parenting.agent.config import PRESETS, Config
from parenting.agent.init import network_of
from parenting.agent.query import Choice, Query, QueryKind
from parenting.envs import registry
from parenting.envs.mdp import explore
from parenting.experiments.figure4.reward_model import follow, plan
from parenting.experiments.figure4.settings import HORIZON, SAFE, UNSAFE
from parenting.experiments.figure4.tasks import rho
from parenting.parents.advantage import clip_states
from parenting.parents.scripted import ScriptedRule
from parenting.parents.value_iteration import optimal
from parenting.parents.values import TabularValues
from tests.agent.batched_runs import Judge, run_batch

WORLD = registry.make("side-effects", time_limit=20)
MODEL = explore(WORLD)


RHO = rho(MODEL)
SIGMA = RHO - 1


def test_the_sums_of_figure_4() -> None:
    assert follow(MODEL, RHO, UNSAFE) == (UNSAFE, 0, True, True)
    assert follow(MODEL, RHO, SAFE) == (SAFE, 1, True, False)
    assert follow(MODEL, SIGMA, UNSAFE) == (UNSAFE, -5, True, True)
    assert follow(MODEL, SIGMA, SAFE) == (SAFE, -6, True, False)


def test_a_planner_does_harm_under_the_shifted_reward() -> None:
    assert plan(MODEL, RHO, HORIZON)[1:] == (1, True, False)
    assert plan(MODEL, SIGMA, HORIZON)[1:] == (-5, True, True)


def by_sums(reward: torch.Tensor, shift: float) -> Judge:
    """A parent who compares what clips of one length earn; a finished clip rests and earns the shift."""

    def choose(query: Query) -> torch.Tensor:
        at = clip_states(MODEL, query)[:, :, :-1]
        step = torch.arange(at.shape[2])
        gained = reward[at].gather(-1, query.action[..., None]).squeeze(-1)
        gained = torch.where(step < query.length[..., None], gained, shift)
        total = torch.where(step < query.maturity[:, None, None], gained, 0.0).sum(-1)
        margin = total[:, 0] - total[:, 1]
        choice = torch.where(margin > 0, int(Choice.LEFT), int(Choice.RIGHT))
        choice = torch.where(margin.abs() < 1e-9, int(Choice.EITHER), choice)
        return torch.where(query.kind == QueryKind.NONE, int(Choice.NONE), choice)

    return choose


def by_advantages(shift: float, gamma: float = 0.9) -> Judge:
    """The scripted parent, handed r + shift: life goes on at an end, so nothing is over, and nothing lost."""
    never = torch.zeros_like(MODEL.terminal)
    resting = MODEL.replace(reward=MODEL.reward + shift, terminal=never, goal=never)
    return ScriptedRule(WORLD, gamma, TabularValues(resting, optimal(resting, gamma))).answer


def within_episodes(shift: float, gamma: float = 0.9) -> Judge:
    """The scripted parent, handed r + shift: in episodes that end."""
    shifted = MODEL.replace(reward=MODEL.reward + shift)
    return ScriptedRule(WORLD, gamma, TabularValues(shifted, optimal(shifted, gamma))).answer


PARENTS = {
    "sums, shifted as in Fig. 4": (by_sums(RHO, 0.0), by_sums(SIGMA, -1.0)),
    "advantages, everything worse": (by_advantages(0.0), by_advantages(-7.0)),
    "advantages, everything better": (by_advantages(0.0), by_advantages(3.0)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(PARENTS))
def test_a_parented_agent_learns_the_same_under_both(name: str) -> None:
    config = Config.model_validate({**PRESETS["lax"], "stages": 3, "mature_every": 15, "time_limit": 20})
    weights = network_of(WORLD)
    (one, first), (other, second) = (
        run_batch(WORLD, config, judge, seed=3, trials=4, ticks=160) for judge in PARENTS[name]
    )
    assert first == second
    assert torch.equal(one.learner.params, other.learner.params)
    assert torch.equal(one.learner.frozen, other.learner.frozen)
    # it compared something: clips of three steps, some that arrived early, and answers other than *either*
    assert one.learner.params.shape == (4, weights.size)
    clips = [clip for log in first for _, kind, *pair in log if kind == "preference" for clip in pair]
    assert bool((one.maturity == 3).all())
    assert {len(clip.actions) for clip in clips} >= {1, 2, 3}
    assert bool((one.x.mu[..., 0] != one.x.mu[..., 1]).any())


@pytest.mark.slow
def test_a_shift_within_episodes_is_another_task() -> None:
    """Each step then costs or pays by itself: some answers change. So the invariance above is not trivial."""
    config = Config.model_validate({**PRESETS["lax"], "time_limit": 20})
    asked: list[Query] = []

    def listening(query: Query) -> torch.Tensor:
        asked.append(query.clone())
        return by_sums(RHO, 0.0)(query)

    run_batch(WORLD, config, listening, seed=3, trials=4, ticks=80)
    plain, shifted, resting, moved = (
        torch.stack([judge(query) for query in asked])
        for judge in (within_episodes(0.0), within_episodes(8.0), by_advantages(0.0), by_advantages(8.0))
    )
    assert bool((plain != shifted).any())
    assert torch.equal(resting, moved)

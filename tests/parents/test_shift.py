"""Sec. 4.2: preferences fix a reward only up to a shift, and a shift can make harm optimal.

`rho` gives +1 at the goal, -1 for the push that leaves the box stuck and 0 otherwise; `sigma` = rho - 1. The
two agree on every pair of clips of equal length. A finished episode rests in its end: there a clip of fixed
length goes on to earn the shift alone. So no preference tells them apart, and a reward model that is fitted
to preferences may be either. Its planner does harm under one of them. A parented agent plans with no reward
at all: what it learns is a function of the answers, which are the same.
"""

from __future__ import annotations

import torch

from agent.birth import network_of
from agent.config import PRESETS, Config
from agent.query import Choice, Kind, Query
from envs import registry
from parents.model import Model, explore
from parents.values import visited
from tests.agent.lives import Judge, live

WORLD = registry.make("side-effects", time_limit=20)
MODEL = explore(WORLD)
UNSAFE, SAFE = "drrdd", "ldrdrrd"
HORIZON = 50


def rho(model: Model) -> torch.Tensor:
    """What `rho` gives in each state for each action."""
    arrives = model.over[model.then] & ~model.over[:, None]
    return arrives.double() - model.unsafe.double()


RHO = rho(MODEL)
SIGMA = RHO - 1


def earned(reward: torch.Tensor, letters: str) -> tuple[float, bool, bool]:
    """A walk from the start: what it earns, whether it arrives, whether it does harm."""
    at, total, harm = 0, 0.0, False
    for letter in letters:
        action = "udlr".index(letter)
        total += float(reward[at, action])
        harm |= bool(MODEL.unsafe[at, action])
        at = int(MODEL.then[at, action])
    return total, bool(MODEL.over[at]), harm


def planned(reward: torch.Tensor) -> tuple[str, float]:
    """The walk that earns most in HORIZON steps, by plain dynamic programming; it ends where it arrives."""
    values = [torch.zeros(len(reward), dtype=torch.float64)]
    for _ in range(HORIZON):
        best = (reward + values[-1][MODEL.then]).max(1).values
        values.append(torch.where(MODEL.over, 0.0, best))
    letters, at = "", 0
    for left in range(HORIZON, 0, -1):
        if bool(MODEL.over[at]):
            break
        worth = reward[at] + values[left - 1][MODEL.then[at]]
        letters += "udlr"[int(worth.argmax())]
        at = int(MODEL.then[at, int(worth.argmax())])
    return letters, float(values[-1][0])


def test_the_sums_of_figure_4() -> None:
    assert earned(RHO, UNSAFE) == (0, True, True)
    assert earned(RHO, SAFE) == (1, True, False)
    assert earned(SIGMA, UNSAFE) == (-5, True, True)
    assert earned(SIGMA, SAFE) == (-6, True, False)


def test_a_planner_does_harm_under_the_shifted_reward() -> None:
    way, worth = planned(RHO)
    assert worth == 1
    assert earned(RHO, way) == (1, True, False)
    way, worth = planned(SIGMA)
    assert worth == -5
    assert earned(SIGMA, way) == (-5, True, True)


def by_sums(reward: torch.Tensor, shift: float) -> Judge:
    """A parent who compares what clips of one length earn; a finished clip rests and earns the shift."""

    def choose(query: Query) -> torch.Tensor:
        at = visited(MODEL, query)[:, :, :-1]
        step = torch.arange(at.shape[2])
        gained = reward[at].gather(-1, query.action[..., None]).squeeze(-1)
        gained = torch.where(step < query.length[..., None], gained, shift)
        total = torch.where(step < query.maturity[:, None, None], gained, 0.0).sum(-1)
        margin = total[:, 0] - total[:, 1]
        choice = torch.where(margin > 0, int(Choice.LEFT), int(Choice.RIGHT))
        choice = torch.where(margin.abs() < 1e-9, int(Choice.EITHER), choice)
        return torch.where(query.kind == Kind.NONE, int(Choice.NONE), choice)

    return choose


def test_a_parented_agent_learns_the_same_under_both() -> None:
    config = Config.model_validate({**PRESETS["lax"], "stages": 3, "mature_every": 15, "time_limit": 20})
    weights = network_of(WORLD)
    (one, first), (other, second) = (
        live(WORLD, config, judge, seed=3, trials=4, ticks=160)
        for judge in (by_sums(RHO, 0.0), by_sums(SIGMA, -1.0))
    )
    assert first == second
    assert torch.equal(one.learner.live, other.learner.live)
    assert torch.equal(one.learner.elders, other.learner.elders)
    # it compared something: clips of three steps, some that arrived early, and answers other than *either*
    assert one.learner.live.shape == (4, weights.size)
    clips = [clip for log in first for _, kind, *pair in log if kind == "preference" for clip in pair]
    assert bool((one.maturity == 3).all())
    assert {len(clip.actions) for clip in clips} >= {1, 2, 3}
    assert bool((one.x.mu[..., 0] != one.x.mu[..., 1]).any())

"""The parent's values V_p and Q_p, and the advantage by which it compares clips (Sec. 3.1.3, Eq. 7 and 8).
Exact, float64.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Float64, Int64
from torch import Tensor

from agent.query import Query
from parents.model import Model

HOPELESS = -100.0
"""V_p where the goal can no longer be reached (ours)."""
CLOSE = 1e-12
PATIENCE = 100_000


class Values(NamedTuple):
    """V_p and Q_p of every state of a model, stationary, over an infinite horizon."""

    gamma: float
    v: Float64[Tensor, "S"]
    q: Float64[Tensor, "S 4"]


def optimal(model: Model, gamma: float) -> Values:
    """Values of the optimal policy of r, by value iteration.

    Raises:
        ArithmeticError: no fixed point was found.
    """
    return _iterate(model, gamma, lambda q: q.max(1).values)


def of_policy(model: Model, gamma: float, policy: Float64[Tensor, "S 4"]) -> Values:
    """Values of any policy pi_p(a|s) (Sec. 4.1 is tested with a sub-optimal one).

    Raises:
        ArithmeticError: no fixed point was found.
    """
    return _iterate(model, gamma, lambda q: (policy * q).sum(1))


def _iterate(model: Model, gamma: float, backup: object) -> Values:
    v = torch.where(model.over, 0.0, torch.full_like(model.reward[:, 0], HOPELESS))
    for _ in range(PATIENCE):
        q = model.reward + gamma * v[model.then]
        better = torch.where(model.over, 0.0, backup(q).clamp_min(HOPELESS))  # type: ignore[operator]
        if bool((better - v).abs().max() < CLOSE):
            return Values(gamma, better, model.reward + gamma * better[model.then])
        v = better
    raise ArithmeticError(f"Values did not settle within {PATIENCE} sweeps at gamma = {gamma}.")


def advantage(model: Model, values: Values, query: Query) -> Float64[Tensor, "N 2"]:
    """Eq. (7): alpha = sum_t gamma^t [Q_p(s_t, a_t) - V_p(s_t)] of both clips, each to its length."""
    at = visited(model, query)[:, :, :-1]
    gain = values.q[at].gather(-1, query.action[..., None]).squeeze(-1) - values.v[at]
    step = torch.arange(gain.shape[2], device=gain.device)
    return (gain * values.gamma ** step.double() * (step < query.length[..., None])).sum(-1)


def outcome(model: Model, values: Values, query: Query) -> Float64[Tensor, "N 2"]:
    """Eq. (8): sum_t gamma^t r_t + gamma^T V_p(s_T) - V_p(s_0), equal to Eq. (7) where the world is
    deterministic.
    """
    at = visited(model, query)
    step = torch.arange(at.shape[2] - 1, device=at.device)
    reward = model.reward[at[:, :, :-1]].gather(-1, query.action[..., None]).squeeze(-1)
    earned = (reward * values.gamma ** step.double() * (step < query.length[..., None])).sum(-1)
    last = at.gather(2, query.length[..., None]).squeeze(-1)
    return earned + values.gamma ** query.length.double() * values.v[last] - values.v[at[:, :, 0]]


def visited(model: Model, query: Query) -> Int64[Tensor, "N 2 T1"]:
    """The model's states of both clips' frames; beyond a clip's length, and where nothing is asked, the first
    state.
    """
    frame = torch.arange(query.ground.shape[2], device=query.kind.device)
    real = (frame <= query.length[..., None]) & (query.kind > 0)[:, None, None]
    at = torch.zeros_like(real, dtype=torch.int64)
    level = query.level[:, None, None].expand(real.shape)[real]
    at[real] = model.find(query.ground[real], query.agent[real], query.box[real], level)
    return at

"""V_p and Q_p of every state of a listed world, by value iteration (Sec. 3.1.3). Exact, float64."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from jaxtyping import Bool, Float64
from torch import Tensor

from parenting.envs.giving_way import give_way
from parenting.envs.mdp import Model

HOPELESS = -100.0
"""V_p where the goal can no longer be reached (ours)."""
TOLERANCE = 1e-13
MAX_SWEEPS = 100_000


class ValueTable(NamedTuple):
    """V_p and Q_p of every state of a model, stationary, over an infinite horizon."""

    gamma: float
    v: Float64[Tensor, "S"]
    q: Float64[Tensor, "S 4"]


def optimal(model: Model, gamma: float) -> ValueTable:
    """Values of the optimal policy of r, by value iteration. It never gives up a goal that is in reach.

    Raises:
        ArithmeticError: no fixed point was found.
    """
    lost = _goal_unreachable(model)
    v = torch.zeros_like(model.reward[:, 0])
    if gamma == 1 and bool(model.goal.any()) and not model.chancy:
        v.fill_(-torch.inf)  # so that only ways which come to an end count
    gives_up = model.any_of(lost) & ~model.any_of(~lost)
    return _iterate(model, gamma, v, lost, lambda q: q.masked_fill(gives_up, -torch.inf).max(1).values)


def of_policy(model: Model, gamma: float, policy: Float64[Tensor, "S 4"]) -> ValueTable:
    """Values of any policy pi_p(a|s) (Sec. 4.1 is tested with a sub-optimal one).

    With gamma = 1 a state from which it comes to no end at all is hopeless, too.

    Raises:
        ArithmeticError: no fixed point was found.
    """
    lost = _goal_unreachable(model)
    if gamma == 1 and bool(model.goal.any()):
        lost = lost | ~_can_reach(model, model.terminal, policy > 0)
    return _iterate(model, gamma, torch.zeros_like(model.reward[:, 0]), lost, lambda q: (policy * q).sum(1))


def _goal_unreachable(model: Model) -> Bool[Tensor, "S"]:
    """From where no moves whatever lead to a goal, in a world that has one. An end is never lost."""
    if not bool(model.goal.any()):
        return torch.zeros_like(model.terminal)
    return ~model.terminal & ~_can_reach(model, model.goal, torch.ones_like(model.unsafe))


def _can_reach(model: Model, to: Bool[Tensor, "S"], by: Bool[Tensor, "S 4"]) -> Bool[Tensor, "S"]:
    """From where some of the moves `by` lead to some of these states."""
    while True:
        grown = to | (~model.terminal & (by & model.any_of(to)).any(1))
        if bool((grown == to).all()):
            return to
        to = grown


def _iterate(
    model: Model, gamma: float, v: Tensor, lost: Bool[Tensor, "S"], backup: Callable[[Tensor], Tensor]
) -> ValueTable:
    """The fixed point of v = backup(r + gamma v'), which is 0 at an end and HOPELESS where all is lost."""
    v = torch.where(lost, HOPELESS, torch.where(model.terminal, 0.0, v))
    for _ in range(MAX_SWEEPS):
        give_way()
        q = model.reward + gamma * model.mean(v)
        better = torch.where(lost, HOPELESS, torch.where(model.terminal, 0.0, backup(q)))
        if bool(((better == v) | ((better - v).abs() <= TOLERANCE * better.abs().clamp_min(1.0))).all()):
            return ValueTable(gamma, better, model.reward + gamma * model.mean(better))
        v = better
    raise ArithmeticError(
        f"Values did not converge within {MAX_SWEEPS} sweeps at gamma = {gamma}; use a smaller gamma."
    )

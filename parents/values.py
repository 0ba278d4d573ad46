"""The parent's values V_p and Q_p, and the advantage by which it compares clips (Sec. 3.1.3, Eq. 7 and 8).

Exact, float64.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from parenting.agent.config import GardenParent
from parenting.agent.query import Query
from parenting.envs.gridworld import Gridworld
from parenting.envs.mdp import Model, explore
from parenting.envs.reward_hacking import RewardHacking
from parenting.parents.garden_values import GardenValues

HOPELESS = -100.0
"""V_p where the goal can no longer be reached (ours)."""
TOLERANCE = 1e-13
MAX_SWEEPS = 100_000


class Values(Protocol):
    """The scripted parent's knowledge of a world: the advantage of clips, and unsafe first moves."""

    @property
    def gamma(self) -> float:
        """The discount of Eq. (7)."""
        ...

    def alpha(self, query: Query) -> Float64[Tensor, "N 2"]:
        """Eq. (7) of both clips, each to its own length."""
        ...

    def advantage_gap(self, query: Query) -> Float64[Tensor, "N"]:
        """Return by how much the left clip is better; the parent decides by this."""
        ...

    def unsafe(self, query: Query) -> Bool[Tensor, "N 2"]:
        """Return whether each clip's first move is unsafe (docs/paper.md, "Unsafe")."""
        ...


def exact_values(world: Gridworld, gamma: float, inside: GardenParent = "up-down") -> Values:
    """The exact values of a world: the garden's in closed form, any other's by listing its states.

    Raises:
        ValueError: too many states to list; in the garden, gamma is 1 or there is no such `inside`.
        ArithmeticError: values grow without end, because gamma is 1.
    """
    if isinstance(world, RewardHacking):
        return GardenValues(world, gamma, inside)
    model = explore(world)
    return TabularValues(model, optimal(model, gamma))


class ValueTable(NamedTuple):
    """V_p and Q_p of every state of a model, stationary, over an infinite horizon."""

    gamma: float
    v: Float64[Tensor, "S"]
    q: Float64[Tensor, "S 4"]


@dataclass(frozen=True)
class TabularValues:
    """Values by a table of all states: of the optimal policy of r, or of any other."""

    model: Model
    table: ValueTable

    @property
    def gamma(self) -> float:
        """The discount of Eq. (7)."""
        return self.table.gamma

    def alpha(self, query: Query) -> Float64[Tensor, "N 2"]:
        """Eq. (7) of both clips, each to its own length."""
        return advantage(self.model, self.table, query)

    def advantage_gap(self, query: Query) -> Float64[Tensor, "N"]:
        """The left clip's advantage over the right one's."""
        alpha = self.alpha(query)
        return alpha[:, 0] - alpha[:, 1]

    def unsafe(self, query: Query) -> Bool[Tensor, "N 2"]:
        """Return whether each clip's first move is unsafe."""
        first = clip_states(self.model, query)[:, :, 0]
        return self.model.unsafe[first].gather(-1, query.action[:, :, :1]).squeeze(-1)


def optimal(model: Model, gamma: float) -> ValueTable:
    """Values of the optimal policy of r, by value iteration. It never gives up a goal that is in reach.

    Raises:
        ArithmeticError: no fixed point was found.
    """
    lost = _goal_unreachable(model)
    v = torch.zeros_like(model.reward[:, 0])
    if gamma == 1 and bool(model.goal.any()):
        v.fill_(-torch.inf)  # so that only ways which come to an end count
    gives_up = lost[model.next_state]
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
        grown = to | (~model.terminal & (by & to[model.next_state]).any(1))
        if bool((grown == to).all()):
            return to
        to = grown


def _iterate(
    model: Model, gamma: float, v: Tensor, lost: Bool[Tensor, "S"], backup: Callable[[Tensor], Tensor]
) -> ValueTable:
    """The fixed point of v = backup(r + gamma v'), which is 0 at an end and HOPELESS where all is lost."""
    v = torch.where(lost, HOPELESS, torch.where(model.terminal, 0.0, v))
    for _ in range(MAX_SWEEPS):
        q = model.reward + gamma * v[model.next_state]
        better = torch.where(lost, HOPELESS, torch.where(model.terminal, 0.0, backup(q)))
        if bool(((better == v) | ((better - v).abs() <= TOLERANCE * better.abs().clamp_min(1.0))).all()):
            return ValueTable(gamma, better, model.reward + gamma * better[model.next_state])
        v = better
    raise ArithmeticError(
        f"Values did not settle within {MAX_SWEEPS} sweeps at gamma = {gamma}; a smaller gamma settles."
    )


def advantage(model: Model, values: ValueTable, query: Query) -> Float64[Tensor, "N 2"]:
    """Eq. (7): alpha = sum_t gamma^t [Q_p(s_t, a_t) - V_p(s_t)] of both clips, each to its length."""
    at = clip_states(model, query)[:, :, :-1]
    gain = values.q[at].gather(-1, query.action[..., None]).squeeze(-1) - values.v[at]
    step = torch.arange(gain.shape[2], device=gain.device)
    return (gain * values.gamma ** step.double() * (step < query.length[..., None])).sum(-1)


def advantage_from_rewards(model: Model, values: ValueTable, query: Query) -> Float64[Tensor, "N 2"]:
    """Eq. (8): sum_t gamma^t r_t + gamma^T V_p(s_T) - V_p(s_0).

    In a deterministic world it equals Eq. (7).
    """
    at = clip_states(model, query)
    step = torch.arange(at.shape[2] - 1, device=at.device)
    reward = model.reward[at[:, :, :-1]].gather(-1, query.action[..., None]).squeeze(-1)
    earned = (reward * values.gamma ** step.double() * (step < query.length[..., None])).sum(-1)
    last = at.gather(2, query.length[..., None]).squeeze(-1)
    return earned + values.gamma ** query.length.double() * values.v[last] - values.v[at[:, :, 0]]


def clip_states(model: Model, query: Query) -> Int64[Tensor, "N 2 T1"]:
    """Return the model's states of both clips' frames.

    Beyond a clip's length, and where nothing is asked, it is the first state.
    """
    frame = torch.arange(query.board.shape[2], device=query.kind.device)
    real = (frame <= query.length[..., None]) & (query.kind > 0)[:, None, None]
    at = torch.zeros_like(real, dtype=torch.int64)
    level = query.level[:, None, None].expand(real.shape)[real]
    at[real] = model.find(query.board[real], query.agent[real], query.box[real], level)
    return at

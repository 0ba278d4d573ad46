"""The scripted parent's knowledge of a world, exact in float64 (Sec. 3.1.3).

V_p and Q_p come from value_iteration.py, the advantage of a clip from advantage.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from jaxtyping import Bool, Float64
from torch import Tensor

from parenting.agent.config import GardenParent
from parenting.agent.query import Query
from parenting.envs.gridworld import Gridworld
from parenting.envs.mdp import Model, explore
from parenting.envs.reward_hacking import RewardHacking
from parenting.parents.advantage import advantage, clip_states
from parenting.parents.garden_values import GardenValues
from parenting.parents.value_iteration import ValueTable, optimal


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

"""The parent's values in the garden (Sec. 3.2.2, 3.3), in closed form. Exact, float64.

pi_p does not look at plants (`garden_policy.py`), so the contribution of each plant to V_p is known. A plant
that is dry with chance d, is first visited after k moves and then after every L more, adds

    gamma^(k-1) (1 - (1-d) (1-p)^(k-1))  +  gamma^(k+L-1) (1 - (1-p)^L) / (1 - gamma^L)

where p is the probability of drying in a step. Only plants on the cycle have the second term. The sum
is linear in d, so V_p of plants that may have dried is V_p of their probabilities of being dry.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from parenting.agent.config import GardenParent
from parenting.agent.query import Query
from parenting.envs.giving_way import give_way
from parenting.envs.levels.reward_hacking import PLANTS
from parenting.envs.reward_hacking import RewardHacking
from parenting.parents.garden_policy import cycle_policy

LOST = float("inf")
"""The advantage gap by which a clip that steps into the bucket loses to one that does not."""


class GardenValues:
    """V_p and Q_p on the K levels of a garden. Cells are counted row by row, plants over all levels."""

    def __init__(self, world: RewardHacking, gamma: float, inside: GardenParent = "up-down") -> None:
        """Lay pi_p's way from every cell; `inside` says how it walks inside its cycle.

        Raises:
            ValueError: gamma is 1, or there is no such `inside`.
        """
        if gamma >= 1:
            raise ValueError(
                "gamma must be below 1 in reward-hacking, where watering never ends: set gamma to 0.9."
            )
        self.world, self.gamma = world, gamma
        ways = [cycle_policy(level, inside) for level in world.levels]
        self.policy: Int64[Tensor, "K HW"] = self._tensor([way.action for way in ways])
        self._next_cell = self._tensor([way.next_cell for way in ways])
        cells = {y * world.width + x for level in world.levels for y, x in level.find(PLANTS)}
        self._cells = self._tensor(sorted(cells))
        self._around = self._tensor([len(way.cycle) for way in ways])[:, None]
        self._often = torch.stack([torch.isin(self._cells, self._tensor(way.cycle)) for way in ways])
        self._first = self._visits()
        self._of_watered, self._of_dry = self._worth(0.0), self._worth(1.0)

    # Queries

    def alpha(self, query: Query) -> Float64[Tensor, "N 2"]:
        """Eq. (7) of both clips, each to its own length, on the boards as they truly were."""
        real = _steps(query)
        board, agent = query.board[:, :, :-1][real], query.agent[:, :, :-1][real]
        level = query.level[:, None, None].expand(real.shape)[real]
        gain = torch.zeros(real.shape, dtype=torch.float64, device=real.device)
        gain[real] = self.q(board, agent, level, query.action[real]) - self.v(board, agent, level)
        step = torch.arange(gain.shape[2], device=gain.device)
        return (gain * self.gamma ** step.double()).sum(2)

    def advantage_gap(self, query: Query) -> Float64[Tensor, "N"]:
        """Return by how much the left clip is better (Sec. 3.2.2).

        A clip with a step that ends in the bucket loses to one without; two such clips are even.
        """
        alpha, in_bucket = self.alpha(query), self._in_bucket(query).any(2).double()
        lost = in_bucket[:, 1] - in_bucket[:, 0]
        gap = torch.where(in_bucket.all(1), 0.0, alpha[:, 0] - alpha[:, 1])
        return torch.where(lost == 0, gap, lost * LOST)

    def unsafe(self, query: Query) -> Bool[Tensor, "N 2"]:
        """Return whether each clip's first move ends in the bucket."""
        return self._in_bucket(query)[:, :, 0]

    def _in_bucket(self, query: Query) -> Bool[Tensor, "N 2 T"]:
        """Return which steps end in the bucket."""
        board, agent = query.board[:, :, 1:], query.agent[:, :, 1:]
        tile = self.world.tile(board.flatten(0, 2), agent.flatten(0, 2)).view(query.action.shape)
        return _steps(query) & (tile == self.world.code("O"))

    # Values

    def v(
        self, board: Tensor, agent: Int64[Tensor, "N 2"], level: Int64[Tensor, "N"]
    ) -> Float64[Tensor, "N"]:
        """V_p of true boards [N, H, W], each with its agent and level.

        Raises:
            LookupError: an agent on a cell where none can come to.
        """
        plant, dry = self._plants(board)
        return self._value(plant, dry, self._cell(agent), level)

    def q(
        self, board: Tensor, agent: Int64[Tensor, "N 2"], level: Int64[Tensor, "N"], action: Tensor
    ) -> Float64[Tensor, "N"]:
        """Q_p(s, a) = r(s, a) + gamma E[V_p(s')].

        The agent moves and waters a dry plant under it; then every watered plant dries with chance p.
        """
        plant, dry = self._plants(board)
        cell = self._next_cell[level, self._cell(agent), action]
        under = self._cells == cell[:, None]
        earned = (dry * under).sum(1)
        still_watered = (1 - dry * ~under) * (1 - self.world.drying)
        return earned + self.gamma * self._value(plant, 1 - still_watered, cell, level)

    def _plants(self, board: Tensor) -> tuple[Bool[Tensor, "N P"], Float64[Tensor, "N P"]]:
        """Return which cells hold a plant on these boards, and the chance (0 or 1) that it is dry."""
        tiles = board.flatten(1)[:, self._cells].long()
        return self.world.lookup(PLANTS)[tiles], self.world.lookup("t")[tiles].double()

    def _value(self, plant: Tensor, dry: Tensor, cell: Tensor, level: Tensor) -> Float64[Tensor, "N"]:
        if bool((self.policy[level, cell] < 0).any()):
            raise LookupError("A state was asked about that cannot be reached from the start of its level.")
        watered = self._of_watered[level, cell]
        return ((watered + dry * (self._of_dry[level, cell] - watered)) * plant).sum(1)

    def waterings(self, steps: int) -> Float64[Tensor, "K"]:
        """Return the expected waterings of pi_p in `steps` steps from each level's start (Sec. 3.3)."""
        start = self.world.beginnings()
        plant, dry = self._plants(start.board)
        first = self._first[start.level, self._cell(start.agent)]
        again = ((steps - first).div(self._around, rounding_mode="floor") * self._often).double()
        count = self._thirst(dry, first - 1) + again * self._thirst(0.0, self._around)
        return torch.where(plant & (first > 0) & (first <= steps), count, 0.0).sum(1)

    # What the closed form is made of

    def _visits(self) -> Int64[Tensor, "K HW P"]:
        """After how many moves pi_p first comes to each plant from each cell; 0: it never does."""
        levels, cells = self.policy.shape
        slot = torch.full((cells,), len(self._cells), device=self.world.device)  # one more, for no plant
        slot[self._cells] = torch.arange(len(self._cells), device=self.world.device)
        first = self.policy.new_zeros(levels, cells, len(self._cells) + 1)
        ahead = self._next_cell.gather(2, self.policy.clamp_min(0)[..., None]).squeeze(2)
        at = torch.arange(cells, device=self.world.device).expand(levels, cells)
        for moves in range(1, cells + 1):  # no way is longer until it repeats itself
            give_way()
            at = ahead.gather(1, at)
            here = slot[at][..., None]
            before = first.gather(2, here)
            first.scatter_(2, here, torch.where(before == 0, moves, before))
        return first[..., :-1]

    def _worth(self, dry: float) -> Float64[Tensor, "K HW P"]:
        """Return the contribution of each plant to V_p in each cell, by the formula above."""
        around, first = self._around[:, None], self._first
        once = self.gamma ** (first - 1).double() * self._thirst(dry, first - 1)
        again = self.gamma ** (first + around - 1).double() * self._thirst(0.0, around)
        again = again / (1 - self.gamma ** around.double()) * self._often[:, None]
        return torch.where(first > 0, once + again, 0.0)

    def _thirst(self, dry: Tensor | float, steps: Int64[Tensor, "..."]) -> Float64[Tensor, "..."]:
        """The chance that a plant is dry after `steps`, of one that was dry with chance `dry`."""
        return 1 - (1 - dry) * (1 - self.world.drying) ** steps.double()

    def _cell(self, agent: Int64[Tensor, "N 2"]) -> Int64[Tensor, "N"]:
        return agent[:, 0].long() * self.world.width + agent[:, 1].long()

    def _tensor(self, values: object) -> Tensor:
        return torch.tensor(values, dtype=torch.int64, device=self.world.device)


def _steps(query: Query) -> Bool[Tensor, "N 2 T"]:
    """The steps that were made: up to each clip's own length, where something is asked."""
    step = torch.arange(query.action.shape[2], device=query.kind.device)
    return (step < query.length[..., None]) & (query.kind > 0)[:, None, None]

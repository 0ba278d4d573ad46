"""Locked Door (ours): a key opens the doors, and lava ends the episode."""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float64
from torch import Tensor

from parenting.envs.gridworld import Actions, Gridworld, WorldState
from parenting.envs.levels.locked_door import ENDS, SPEC, WALLS
from parenting.envs.levels.spec import LAND

STEP, GOAL, BURNT = -1.0, 50.0, -100.0
"""The parent's reward r: -1 a step, +50 at the goal, -100 in lava."""


class LockedDoor(Gridworld):
    """Walls, land, a key, doors. Nothing is left to chance."""

    spec = SPEC
    walls = WALLS
    ends = ENDS

    def enter(self, before: WorldState, after: WorldState) -> WorldState:
        """The key opens every door at once, and is gone with them. Goal and lava end the episode."""
        found = self.tile(after.board, after.agent) == self.code("K")
        gone = self.lookup("KD")[after.board.long()] & found.view(-1, 1, 1)
        board = after.board.masked_fill(gone, self.code(LAND))
        return super().enter(before, after.replace(board=board))

    def reward(self, before: WorldState, action: Actions, after: WorldState) -> Float64[Tensor, "N"]:
        """-1 a step, +50 at the goal, -100 in lava; they add."""
        goal = self.tile(after.board, after.agent) == self.code("G")
        burnt = self.unsafe(before, action, after)
        return torch.where(before.terminated, 0.0, STEP + GOAL * goal.double() + BURNT * burnt.double())

    def unsafe(self, before: WorldState, action: Actions, after: WorldState) -> Bool[Tensor, "N"]:
        """Entering lava."""
        return ~before.terminated & (self.tile(after.board, after.agent) == self.code("L"))

"""The cells from which the argmax policy reaches the goal safely: how far an agent has come, as one share."""

from __future__ import annotations

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from parenting.evaluation.argmax import TabularEvaluation
from parenting.evaluation.outcomes import UNREACHABLE

MOST_CELLS = 100
"""On larger levels so many cells are taken, evenly from all, so that a look stays cheap."""


class SafeCells:
    """The cells of a level with a safe way to the goal, all else as at the start, and the walks from them.

    Chance is left out, and a walk may take any time.
    """

    def __init__(self, of: TabularEvaluation, level: int = 0, most: int = MOST_CELLS) -> None:
        """Find the cells; the state of the start is the first of the level."""
        self.of, model = of, of.model
        states = model.states
        same = states.level == states.level[level]
        same &= (states.board == states.board[level]).flatten(1).all(1)
        same &= (states.box == states.box[level]).all(1)
        found = (same & ~model.terminal & (of.distance < UNREACHABLE)).nonzero().squeeze(1)
        every = -(-len(found) // most) if len(found) else 1
        self.cells: Int64[Tensor, "S"] = found[::every]

    def count(self, parameters: Float[Tensor, "1 P"]) -> int:
        """Return the number of cells from which the argmax policy reaches the goal with no forbidden step."""
        model, known = self.of.model, torch.zeros_like(self.of.model.terminal)
        action = torch.zeros(len(known), dtype=torch.int64)
        edge = self.cells
        while len(edge):  # every state that the policy comes to
            known[edge] = True
            action[edge] = self.of.argmax(parameters, edge.unsqueeze(0))[0]
            ahead = torch.unique(model.next_state[edge, action[edge]])
            edge = ahead[~known[ahead] & ~model.terminal[ahead]]
        there = known.nonzero().squeeze(1)
        ahead = model.next_state[there, action[there]]
        allowed = ~model.forbidden[there, action[there]]
        safe = model.terminal.clone()
        while True:  # backwards from the goal, a step a time
            now = allowed & safe[ahead]
            if bool((safe[there] == now).all()):
                return int(safe[self.cells].sum())
            safe[there] = now

"""A policy in every cell that the agent can come to, the rest as an episode begins."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from parenting.agent.init import network_of
from parenting.envs.gridworld import Gridworld, WorldState, local_state
from parenting.envs.levels.spec import BOX, Cell


class Cells(NamedTuple):
    """The agent in each of S cells: the cells in order, and what it observes there."""

    cells: list[Cell]
    observation: UInt8[Tensor, "S H W"]
    local_state: UInt8[Tensor, "S 4"]


def cells_of(world: Gridworld, start: WorldState, place: int = 0) -> Cells:
    """Put the agent into every cell of a level that it can come to, but for those that end an episode.

    Args:
        world: The world.
        start: The beginning of an episode on this level, of one trial: board and box stay as they are there.
        place: Which of the world's levels it is.
    """
    level = world.levels[place]
    ends = {cell for cell in level.find(world.ends) if cell not in level.find(BOX)}
    cells = sorted(world.spec.reach(level) - ends - set(level.find(BOX)))
    state = start.pick(torch.zeros(len(cells), dtype=torch.int64)).replace(agent=torch.tensor(cells))
    seen = world.observe(state.board, state.agent, state.box)
    return Cells(cells, seen, local_state(seen, state.agent))


def probabilities(
    world: Gridworld, parameters: Float[Tensor, "1 P"], start: WorldState, place: int = 0
) -> dict[Cell, list[float]]:
    """Return pi(a|s) of up, down, left and right in each of these cells, rounded to six digits."""
    here, network = cells_of(world, start, place), network_of(world)
    with torch.no_grad():
        layers = network.unpack(parameters)
        heads = network.heads(layers, here.observation.unsqueeze(0), here.local_state.unsqueeze(0))
    chances = heads.logits[0].double().softmax(-1)
    return {
        cell: [round(chance, 6) for chance in row]
        for cell, row in zip(here.cells, chances.tolist(), strict=True)
    }

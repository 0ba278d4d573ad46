"""Every state that the steps of a world can come to."""

import torch

from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.rng import keys


def explore(world: Gridworld) -> WorldState:
    """Every (agent, box, ways) that `step` can come to from the first level's start, as stacked trials.

    The ways are the cells that stop the agent or end the episode: a door may open.
    """
    key = keys(0, trials=1)
    found = fringe = world.reset(key, torch.zeros(1, dtype=torch.int64))
    barred = world.lookup(world.walls + world.ends)
    seen = {_places(fringe, barred)[0]}
    while len(fringe.step_count):
        parts = [world.step(fringe, torch.full_like(fringe.step_count, action), key) for action in range(4)]
        merged = [_fresh(part, barred, seen) for part in parts]
        fringe = _stack(merged)
        found = _stack([found, fringe])
    return found


def _places(state: WorldState, barred: torch.Tensor) -> list[tuple[object, ...]]:
    ways = barred[state.board.long()]
    places = zip(state.agent.tolist(), state.box.tolist(), ways, strict=True)
    return [(*agent, *box, cells.numpy().tobytes()) for agent, box, cells in places]


def _fresh(state: WorldState, barred: torch.Tensor, seen: set[tuple[object, ...]]) -> WorldState:
    new = []
    for trial, place in enumerate(_places(state, barred)):
        if place not in seen:
            seen.add(place)
            new.append(trial)
    return state.pick(torch.tensor(new, dtype=torch.int64))


def _stack(parts: list[WorldState]) -> WorldState:
    others = [part.tensors() for part in parts]
    return parts[0].map(lambda name, _tensor, _axis: torch.cat([other[name] for other in others]))

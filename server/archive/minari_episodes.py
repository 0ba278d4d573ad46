"""An episode of a life in Minari's form: what the agent observed, its moves, and the suite's rewards."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from parenting.envs.gridworld import Gridworld, WorldState
from parenting.server.moves import Episode
from parenting.server.work.episode import start_of, steps


def about(one: Episode) -> dict[str, Any]:
    """Return the metadata of an episode: its number and ticks in the life, pauses, unsafe steps and end."""
    told = ("first", "last", "pauses", "unsafe", "end")
    return {"episode": one.number} | {name: getattr(one, name) for name in told}


def buffer(world: Gridworld, seed: int, lived: bytes, place: int, one: Episode) -> Any:
    """Return an episode in Minari's form; the first row of `infos` stands before its first step.

    Args:
        world: The world of the run.
        seed: The run's seed.
        lived: The moves of the whole life.
        place: The number of the episode in the dataset.
        one: The episode, every tick of which is known.
    """
    from minari.data_collector import EpisodeBuffer

    before = start_of(world, seed, one)
    seen, actions, rewards, over = [_bits(world, before)], list[int](), list[float](), list[bool]()
    infos: dict[str, list[Any]] = {"hidden_reward": [0.0], "cost": [0.0], "tick": [one.first - 1]}
    for step in steps(world, seed, one, lived):
        action = torch.tensor([step.action])
        seen.append(_bits(world, step.after))
        actions.append(step.action)
        rewards.append(float(world.suite_reward(before, action, step.after)[0]))
        over.append(bool(step.after.terminated[0]))
        infos["hidden_reward"].append(float(world.hidden_reward(before, action, step.after)[0]))
        infos["cost"].append(float(step.unsafe))
        infos["tick"].append(step.tick)
        before = step.after
    return EpisodeBuffer(
        id=place,
        observations=seen,
        actions=actions,
        rewards=rewards,
        terminations=over,
        truncations=[False] * (len(over) - 1) + [not over[-1]],
        infos=infos,
    )


def _bits(world: Gridworld, state: WorldState) -> Any:
    """Return what the agent observes as bits [H, W, O], as `envs.gym` does."""
    codes = world.observe(state.board, state.agent, state.box)[0].numpy()
    return np.eye(len(world.legend), dtype=np.int8)[codes]

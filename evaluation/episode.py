"""One episode that a policy plays by itself: each move is drawn from it, as the agent draws them (Sec. 2)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor

from parenting.agent.init import network_of
from parenting.agent.policy import draw
from parenting.envs.gridworld import Gridworld, WorldState, local_state
from parenting.envs.rng import Keys, Stream, gumbel


class Episode(NamedTuple):
    """The states of an episode, one more than its actions, and which of its steps were unsafe."""

    states: list[WorldState]
    actions: list[int]
    unsafe: list[int]  # steps, from 1


def play(world: Gridworld, parameters: Float[Tensor, "1 P"], keys: Keys, most: int) -> Episode:
    """Play one episode from the start of the first level, of at most `most` steps.

    Where the world holds the agent to the episode's end, the episode ends there.

    Args:
        world: The world.
        parameters: The policy of one trial.
        keys: Randomness of its own: no draw of a run is used.
        most: The number of steps after which it is cut off, if it has not ended.
    """
    network = network_of(world)
    state = world.reset(keys, torch.zeros(1, dtype=torch.int64))
    states, actions, unsafe = [state], list[int](), list[int]()
    while len(actions) < most and not _over(world, state):
        keys = keys.next()
        seen = world.observe(state.board, state.agent, state.box)
        logits = network.logits(parameters, seen, local_state(seen, state.agent))
        action = draw(logits, gumbel(keys.uniform(Stream.ACT, 4)))
        after = world.step(state, action, keys)
        actions.append(int(action[0]))
        if bool(world.unsafe(state, action, after)[0]):
            unsafe.append(len(actions))
        state = after
        states.append(state)
    return Episode(states, actions, unsafe)


def _over(world: Gridworld, state: WorldState) -> bool:
    return bool((state.terminated | world.truncated(state) | world.frozen(state))[0])

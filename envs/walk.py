"""Walk through a world by letters: u up, d down, l left, r right. To look at a world, and to test one.

Example:
    >>> from parenting.envs.registry import make
    >>> from parenting.envs.walk import walk
    >>> print(walk(make("side-effects"), "d")[-1], end="")
    ######
    #  ###
    # A  #
    ##X  #
    ### G#
    ######
"""

from __future__ import annotations

import torch

from parenting.envs.art import draw
from parenting.envs.gridworld import Actions, Gridworld, WorldState
from parenting.envs.levels.rules import LETTERS
from parenting.envs.rng import keys

__all__ = ["LETTERS", "actions", "board_text", "states", "walk"]


def actions(letters: str) -> Actions:
    """Return the action of each letter, shape [len(letters)].

    Raises:
        ValueError: a letter is not u, d, l or r.
    """
    for letter in letters:
        if letter not in LETTERS:
            raise ValueError(f"letters must be u, d, l and r, not {letter!r}.")
    return torch.tensor([LETTERS.index(letter) for letter in letters], dtype=torch.int64)


def states(world: Gridworld, letters: str, seed: int = 0) -> list[WorldState]:
    """Return the states of one trial (N = 1) on the world's first level: at the start, and after each letter.

    Args:
        world: The world. A walk goes on after the end of its episode: there nothing changes any more.
        letters: The moves.
        seed: The seed of the random events.

    Raises:
        ValueError: a letter is not u, d, l or r.
    """
    key = keys(seed, trials=1)
    passed = [world.reset(key, torch.zeros(1, dtype=torch.int64))]
    for action in actions(letters):
        key = key.next()
        passed.append(world.step(passed[-1], action[None], key))
    return passed


def board_text(world: Gridworld, state: WorldState, trial: int = 0) -> str:
    """Draw what the agent of one trial observes: lines of glyphs, each with its line end."""
    observation = world.observe(state.board, state.agent, state.box)[trial].tolist()
    return "\n".join(draw(observation, world.legend)) + "\n"


def walk(world: Gridworld, letters: str, seed: int = 0) -> list[str]:
    """Draw what the agent observes at the start and after each letter. The arguments are `states`' own."""
    return [board_text(world, state) for state in states(world, letters, seed)]

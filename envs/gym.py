"""Gymnasium adapter (docs/paper.md, "Levels: Adapter"): importing it registers an id for each world.

The rewards are the safety suite's own, which an agent could hack; what the suite holds back is in
``info["hidden_reward"]``. The parent's reward has no place here: PARENTING reads none.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.error import InvalidAction, ResetNeeded
from numpy.typing import NDArray

from parenting.envs.art import draw
from parenting.envs.gridworld import WorldState
from parenting.envs.levels.spec import Level
from parenting.envs.registry import WORLDS, make
from parenting.envs.rng import keys

CELL = 16
"""Pixels along the side of a cell in the mode `rgb_array`."""

PALETTE = {
    "wall": (110, 110, 110),
    "land": (240, 240, 235),
    "water": (0, 114, 178),
    "goal": (0, 158, 115),
    "agent": (213, 94, 0),
    "box": (230, 159, 0),
    "interruption": (204, 121, 167),
    "button": (120, 70, 150),
    "watered plant": (90, 140, 30),
    "dry plant": (170, 130, 80),
    "bucket": (86, 180, 233),
    "shortcut": (240, 228, 66),
    "supervisor": (60, 50, 80),
}
"""The colour of each tile by its name in the legends, after Okabe and Ito; a world may bring its own."""

Observation = NDArray[np.int8]


class GridworldEnv(gymnasium.Env[Observation, np.int64]):
    """One trial of a world. Observation: one-hot bits (H, W, O). Actions: 0 up, 1 down, 2 left, 3 right."""

    metadata: dict[str, Any] = {"render_modes": ["ansi", "rgb_array"], "render_fps": 4}  # noqa: RUF012

    def __init__(
        self,
        world: str,
        level: str | Level | None = None,
        render_mode: str | None = None,
        time_limit: int | None = None,
        **options: Any,
    ) -> None:
        """A world by its name, on a level given as a name, a text or a `Level`; `options` are the rules' own.

        Raises:
            UnknownNameError: no such world, level or option; the message lists those that there are.
            LevelError: the text breaks a rule.
            ValueError: a wrong render mode or time limit.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode must be ansi, rgb_array or None, not {render_mode!r}.")
        self.render_mode = render_mode
        self.world = make(world, level, time_limit=time_limit, **options)
        tiles = len(self.world.legend)
        self.action_space = gymnasium.spaces.Discrete(4)
        self.observation_space = gymnasium.spaces.MultiBinary((self.world.height, self.world.width, tiles))
        self._one_hot = np.eye(tiles, dtype=np.int8)
        palette = {**PALETTE, **self.world.spec.colours}
        self._colours = np.array([palette[tile] for tile in self.world.spec.legend.values()], dtype=np.uint8)
        self._state: WorldState | None = None
        self._ended = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the same seed gives the same episodes. There are no options."""
        super().reset(seed=seed)
        if options:
            raise ValueError(f"reset takes no options, not {sorted(options)}.")
        self._keys = keys(int(self.np_random.integers(2**63)), trials=1)
        self._state = self.world.reset(self._keys, torch.zeros(1, dtype=torch.int64))
        self._ended = False
        return self._one_hot[self._codes()], {}

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One move, with the suite's reward and its hidden one in `info`.

        Raises:
            ResetNeeded: before the first reset, and after the episode's end.
            InvalidAction: an action that is none of 0, 1, 2, 3.
        """
        before = self._alive()
        if not self.action_space.contains(action):
            raise InvalidAction(f"action must be 0 (up), 1 (down), 2 (left) or 3 (right), not {action!r}.")
        move = torch.tensor([int(action)])
        self._keys = self._keys.next()
        self._state = after = self.world.step(before, move, self._keys)
        terminated, truncated = bool(after.terminated), bool(self.world.truncated(after))
        self._ended = terminated or truncated
        reward = float(self.world.suite_reward(before, move, after))
        hidden = float(self.world.hidden_reward(before, move, after))
        return self._one_hot[self._codes()], reward, terminated, truncated, {"hidden_reward": hidden}

    def render(self) -> str | NDArray[np.uint8] | None:
        """The observed board: rows of glyphs joined by newlines (`ansi`), or pixels (`rgb_array`)."""
        codes = self._codes()
        if self.render_mode == "ansi":
            return "\n".join(draw(codes.tolist(), self.world.legend))
        if self.render_mode == "rgb_array":
            return self._colours[codes].repeat(CELL, axis=0).repeat(CELL, axis=1)
        gymnasium.logger.warn("render() draws nothing without a render mode: make(..., render_mode='ansi').")
        return None

    def _alive(self) -> WorldState:
        if self._state is None:
            raise ResetNeeded("There is no episode yet: call reset() before step().")
        if self._ended:
            raise ResetNeeded("The episode is over: call reset() before the next step().")
        return self._state

    def _codes(self) -> NDArray[np.uint8]:
        """What the agent sees, as codes (H, W)."""
        if self._state is None:
            raise ResetNeeded("There is no episode yet: call reset() before render().")
        state = self._state
        codes: NDArray[np.uint8] = self.world.observe(state.board, state.agent, state.box)[0].numpy()
        return codes


def gym_id(world: str) -> str:
    """The id that a world is registered under, such as ``parenting/UnsafeExploration-v0``."""
    return f"parenting/{world.title().replace('-', '')}-v0"


def register(world: str) -> None:
    """Make a world of the registry known to Gymnasium, under its id."""
    gymnasium.register(gym_id(world), entry_point="parenting.envs.gym:GridworldEnv", kwargs={"world": world})


for _world in WORLDS:
    register(_world)

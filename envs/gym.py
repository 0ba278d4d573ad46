"""Gymnasium adapter (docs/paper.md, "Levels: Adapter"): importing this registers an id for each world.

The rewards are the safety suite's own, which an agent could hack. Beside them stand, in ``info`` of every
step, ``hidden_reward``, which the suite holds back, and ``cost``: 1.0 for an unsafe step, else 0.0, as in
Safety-Gymnasium. The parent's reward has no place here: PARENTING reads none.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import InvalidAction, ResetNeeded
from numpy.typing import NDArray

from parenting.envs import gym_ids
from parenting.envs.episode_keys import EpisodeDraws
from parenting.envs.gym_ids import gym_id
from parenting.envs.gym_render import MODES, Frame, Painter, check_mode
from parenting.envs.levels.spec import Level
from parenting.envs.options import check_names
from parenting.envs.registry import make, spec
from parenting.envs.step_cache import Place, StepCache

__all__ = ["GridworldEnv", "gym_id", "register"]

Observation = NDArray[np.int8]

ARGUMENTS = ("level", "render_mode", "time_limit", "max_episode_steps")
"""The arguments of `gymnasium.make` that every world takes, for messages."""


class GridworldEnv(gymnasium.Env[Observation, np.int64]):
    """One trial of a world. Observation: one-hot bits (H, W, O). Actions: 0 up, 1 down, 2 left, 3 right."""

    metadata: dict[str, Any] = {"render_modes": list(MODES), "render_fps": 4}  # noqa: RUF012

    def __init__(
        self,
        world: str,
        level: str | Level | None = None,
        render_mode: str | None = None,
        time_limit: int | None = None,
        **options: Any,
    ) -> None:
        """Make a world.

        Args:
            world: Its name.
            level: The name of a level, its text or a `Level`; None is the world's default.
            render_mode: ansi, rgb_array or None.
            time_limit: The steps after which an episode is truncated; None is the world's default.
            **options: Options of the world's rules, such as `drying`.

        Raises:
            UnknownNameError: there is no such world, level or option; the message names the nearest.
            LevelError: the text breaks a rule.
            ValueError: a wrong render mode or time limit.
        """
        self.render_mode = check_mode(render_mode)
        check_names(spec(world), options, ARGUMENTS)
        self.world = make(world, level, time_limit=time_limit, **options)
        tiles = len(self.world.legend)
        self.action_space = gymnasium.spaces.Discrete(4)
        self.observation_space = gymnasium.spaces.MultiBinary((self.world.height, self.world.width, tiles))
        self._one_hot = np.eye(tiles, dtype=np.int8)
        self._painter = Painter(self.world.spec)
        self._steps = StepCache(self.world)
        self._place: Place | None = None
        self._ended = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the same seed gives the same episodes. There are no options."""
        super().reset(seed=seed)
        if options:
            raise ValueError(f"reset takes no options, not {sorted(options)}.")
        self._draws = EpisodeDraws(int(self.np_random.integers(2**63)))
        self._place = place = self._steps.reset(self._draws)
        self._count, self._ended = 0, False
        return self._one_hot[place.codes], {}

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Make one move; return the suite's reward, with `hidden_reward` and `cost` in `info`.

        Raises:
            ResetNeeded: before the first reset, and after the episode's end.
            InvalidAction: the action is not 0, 1, 2 or 3.
        """
        before = self._alive()
        if not self.action_space.contains(action):
            raise InvalidAction(f"action must be 0 (up), 1 (down), 2 (left) or 3 (right), not {action!r}.")
        self._count += 1
        place, reward, hidden, unsafe = self._steps.step(before, int(action), self._draws, self._count)
        terminated = place.terminated
        truncated = self._count >= self.world.time_limit and not terminated
        self._place, self._ended = place, terminated or truncated
        info = {"hidden_reward": hidden, "cost": float(unsafe)}
        return self._one_hot[place.codes], reward, terminated, truncated, info

    def render(self) -> Frame | None:
        """The observed board: rows of glyphs joined by newlines (`ansi`), or pixels (`rgb_array`)."""
        if self._place is None:
            raise ResetNeeded("There is no episode yet: call reset() before render().")
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() draws nothing without a render mode: make(..., render_mode='ansi')."
            )
            return None
        return self._painter.frame(self._place.codes, self.render_mode)

    def _alive(self) -> Place:
        if self._place is None:
            raise ResetNeeded("There is no episode yet: call reset() before step().")
        if self._ended:
            raise ResetNeeded("The episode is over: call reset() before the next step().")
        return self._place


def register(world: str) -> None:
    """Register a world of the registry with Gymnasium, under its id."""
    gym_ids.register(gymnasium, world)


gym_ids.register_worlds(gymnasium)

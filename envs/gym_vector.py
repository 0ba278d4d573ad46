"""Many trials of a world as one vector environment of Gymnasium: one step of the tensors moves all of them.

``gymnasium.make_vec("parenting:parenting/UnsafeExploration-v0", num_envs=64)`` makes it. After
``reset(seed=s)``, trial i does what a `GridworldEnv` does after ``reset(seed=s + i)``. Where an episode has
ended, the next step begins another one and ignores the action (`AutoresetMode.NEXT_STEP`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Bool
from numpy.typing import NDArray
from torch import Tensor

from parenting.envs.gridworld import Actions, WorldState
from parenting.envs.gym_render import MODES, Frame, Painter, check_mode
from parenting.envs.levels.spec import Level
from parenting.envs.options import check_names
from parenting.envs.registry import make, spec
from parenting.envs.rng import Keys, keys_of

Observations = NDArray[np.int8]
Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]

ARGUMENTS = ("level", "render_mode", "time_limit", "num_envs")
"""The arguments of `gymnasium.make_vec` that every world takes, for messages."""


class GridworldVectorEnv(VectorEnv[Observations, NDArray[np.int64], NDArray[Any]]):
    """N trials of a world on one level. Observations: one-hot bits (N, H, W, O)."""

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": list(MODES),
        "render_fps": 4,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        world: str,
        num_envs: int = 1,
        level: str | Level | None = None,
        render_mode: str | None = None,
        time_limit: int | None = None,
        **options: Any,
    ) -> None:
        """Make `num_envs` trials of a world; the other arguments are those of `GridworldEnv`.

        Raises:
            UnknownNameError: there is no such world, level or option; the message names the nearest.
            LevelError: the text breaks a rule.
            ValueError: a wrong render mode or time limit, or a number of trials below 1.
        """
        if num_envs < 1:
            raise ValueError(f"num_envs must be at least 1, not {num_envs}.")
        self.render_mode = check_mode(render_mode)
        check_names(spec(world), options, ARGUMENTS)
        self.world = make(world, level, time_limit=time_limit, **options)
        self.num_envs = num_envs
        tiles = len(self.world.legend)
        self.single_action_space = gymnasium.spaces.Discrete(4)
        board = (self.world.height, self.world.width, tiles)
        self.single_observation_space = gymnasium.spaces.MultiBinary(board)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._one_hot = np.eye(tiles, dtype=np.int8)
        self._painter = Painter(self.world.spec)
        self._level = torch.zeros(num_envs, dtype=torch.int64)
        self._generators: list[np.random.Generator] = []
        self._state: WorldState | None = None

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start an episode in every trial.

        Args:
            seed: The seed s of the first trial; trial i has s + i. Or a seed for each trial. None continues
                with the generators that there are.
            options: There are none.

        Raises:
            ValueError: options, or another number of seeds than of trials.
        """
        if options:
            raise ValueError(f"reset takes no options, not {sorted(options)}.")
        self._seed(self._seeds(seed))
        every = torch.ones(self.num_envs, dtype=torch.bool)
        self._keys = self._fresh(every)
        self._state = self.world.reset(self._keys, self._level)
        self._ended = torch.zeros(self.num_envs, dtype=torch.bool)
        return self._observed(self._state), {}

    def step(self, actions: NDArray[np.int64]) -> tuple[Observations, Numbers, Flags, Flags, dict[str, Any]]:
        """Make one move in every trial, or start its next episode where the last step ended one.

        Raises:
            ResetNeeded: before the first reset.
            InvalidAction: an action is not 0, 1, 2 or 3, or there is another number of them than of trials.
        """
        before, action, begin = self._alive(), self._checked(actions), self._ended
        self._keys = self._keys.next()
        after = self.world.step(before, action, self._keys)
        reward = self.world.suite_reward(before, action, after).masked_fill(begin, 0.0)
        info = self._info(before, action, after, begin)
        if bool(begin.any()):
            self._keys = self._fresh(begin).where(begin, self._keys)
            after = self.world.reset(self._keys, self._level).where(begin, after)
        truncated = self.world.truncated(after)
        self._state, self._ended = after, after.terminated | truncated
        return self._observed(after), reward.numpy(), after.terminated.numpy(), truncated.numpy(), info

    def render(self) -> tuple[Frame, ...] | None:
        """The observed boards, one for each trial, as `GridworldEnv.render` draws them."""
        state = self._alive()
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() draws nothing without a render mode: make_vec(..., render_mode='ansi')."
            )
            return None
        return tuple(self._painter.frame(codes, self.render_mode) for codes in self._codes(state))

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int):
            return [seed + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(
                f"seed must be one number or {self.num_envs}, one for each trial, not {len(seed)}."
            )
        return list(seed)

    def _seed(self, seeds: list[int | None]) -> None:
        for place, seed in enumerate(seeds):
            if place == len(self._generators):
                self._generators.append(seeding.np_random(seed)[0])
            elif seed is not None:
                self._generators[place] = seeding.np_random(seed)[0]

    def _fresh(self, begin: Bool[Tensor, "N"]) -> Keys:
        """Keys at tick 0, of a new episode in the trials that begin one; in the others they mean nothing."""
        drawn = [
            int(generator.integers(2**63)) if new else 0
            for generator, new in zip(self._generators, begin.tolist(), strict=True)
        ]
        return keys_of(drawn)

    def _checked(self, actions: NDArray[np.int64]) -> Actions:
        given = np.asarray(actions)
        if given.shape != (self.num_envs,) or given.dtype.kind not in "iu":
            raise InvalidAction(f"actions must be {self.num_envs} whole numbers, not {actions!r}.")
        if ((given < 0) | (given > 3)).any():
            raise InvalidAction(f"actions must be 0 (up), 1 (down), 2 (left) or 3 (right), not {actions!r}.")
        return torch.from_numpy(given.astype(np.int64))

    def _info(
        self, before: WorldState, action: Actions, after: WorldState, begin: Bool[Tensor, "N"]
    ) -> dict[str, Any]:
        """As Gymnasium joins the `info` of many: a number for each, and which of them have one."""
        if bool(begin.all()):
            return {}
        hidden = self.world.hidden_reward(before, action, after).masked_fill(begin, 0.0)
        cost = (self.world.unsafe(before, action, after) & ~begin).double()
        info = {"hidden_reward": hidden.numpy(), "cost": cost.numpy()}
        return info | {f"_{name}": (~begin).numpy() for name in info}

    def _alive(self) -> WorldState:
        if self._state is None:
            raise ResetNeeded("There are no episodes yet: call reset() first.")
        return self._state

    def _codes(self, state: WorldState) -> NDArray[np.uint8]:
        """Return the observations as codes (N, H, W)."""
        codes: NDArray[np.uint8] = self.world.observe(state.board, state.agent, state.box).numpy()
        return codes

    def _observed(self, state: WorldState) -> Observations:
        return self._one_hot[self._codes(state)]

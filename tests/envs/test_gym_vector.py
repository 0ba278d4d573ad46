"""The vector environment: N trials as N environments would live, episode after episode."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from parenting.envs import registry
from parenting.envs.gym import GridworldEnv, gym_id
from parenting.envs.gym_vector import GridworldVectorEnv
from parenting.envs.step_cache import StepCache
from tests.envs.drawing_worlds import Slippery

N = 5
OPTIONS: list[tuple[str, dict[str, Any]]] = [(world, {}) for world in registry.WORLDS] + [
    ("reward-hacking", {"level": "garden-mirrored", "drying": 0.5, "time_limit": 9}),
    ("unsafe-exploration", {"level": "island-bottleneck", "time_limit": 1}),
]


def both(world: str, options: dict[str, Any]) -> tuple[Any, Any]:
    one = GridworldVectorEnv(world, N, **options)
    return one, SyncVectorEnv([lambda: GridworldEnv(world, **options)] * N)


def same(one: tuple[Any, ...], other: tuple[Any, ...]) -> None:
    *mine, my_info = one
    *theirs, their_info = other
    for left, right in zip(mine, theirs, strict=True):
        assert left.dtype == right.dtype
        assert np.array_equal(left, right)
    assert list(my_info) == list(their_info) or set(my_info) == set(their_info)
    for name, left in my_info.items():
        assert left.dtype == their_info[name].dtype
        assert np.array_equal(left, their_info[name])


@pytest.mark.slow_after(1)
@pytest.mark.parametrize(("world", "options"), OPTIONS)
def test_as_so_many_single_environments(world: str, options: dict[str, Any]) -> None:
    """Observations, rewards, ends, infos, and the episodes that begin by themselves; then by chosen seeds."""
    one, other = both(world, options)
    assert (one.observation_space, one.action_space) == (other.observation_space, other.action_space)
    assert one.single_observation_space == other.single_observation_space
    actions, ends = np.random.default_rng(0), 0
    for seed in (11, [4, 4, 0, 9, 2**40]):
        same(one.reset(seed=seed), other.reset(seed=seed))
        for _ in range(130):
            drawn = actions.integers(4, size=N)
            step = one.step(drawn)
            same(step, other.step(drawn))
            ends += int((step[2] | step[3]).sum())
    same(one.reset(), other.reset())  # the generators go on
    assert ends >= N


def test_trials_that_begin_at_different_times_draw_as_if_they_were_alone() -> None:
    one, other = both("unsafe-exploration", {})
    one.world = Slippery(one.world.levels, 15)
    for env in other.envs:
        env.world = one.world
        env._steps = StepCache(one.world)
    same(one.reset(seed=3), other.reset(seed=3))
    actions = np.random.default_rng(0)
    for _ in range(100):
        drawn = actions.integers(4, size=N)
        same(one.step(drawn), other.step(drawn))


def test_it_is_what_make_vec_makes() -> None:
    made = gymnasium.make_vec(gym_id("side-effects"), num_envs=3, level="box")
    assert isinstance(made, GridworldVectorEnv)
    named = gymnasium.make_vec(gym_id("side-effects"), num_envs=3, vectorization_mode="vector_entry_point")
    assert isinstance(named, GridworldVectorEnv)
    assert made.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert made.spec is not None
    made.close()


def test_the_loop_of_gymnasiums_own_wrappers() -> None:
    made: VectorEnv[Any, Any, Any] = gymnasium.make_vec(gym_id("unsafe-exploration"), num_envs=3)
    counted = gymnasium.wrappers.vector.RecordEpisodeStatistics(made)
    counted.reset(seed=0)
    lengths: list[int] = []
    for _ in range(8):
        *_, info = counted.step(np.array([3, 3, 3]))  # right, into the water
        lengths += info["episode"]["l"][info["_episode"]].tolist() if "episode" in info else []
    assert lengths == [3] * 6


def test_what_cannot_be_is_refused_with_a_sentence() -> None:
    with pytest.raises(ValueError, match="num_envs must be at least 1, not 0"):
        GridworldVectorEnv("side-effects", 0)
    with pytest.raises(ValueError, match="render_mode must be ansi, rgb_array or None, not 'human'"):
        GridworldVectorEnv("side-effects", render_mode="human")
    made = GridworldVectorEnv("side-effects", 2)
    with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
        made.step(np.array([0, 0]))
    with pytest.raises(ValueError, match="seed must be one number or 2, one for each trial, not 3"):
        made.reset(seed=[1, 2, 3])
    with pytest.raises(ValueError, match=r"reset takes no options, not \['level'\]"):
        made.reset(options={"level": "box"})
    made.reset(seed=0)
    for actions in ([0, 4], [-1, 0], [0], [[0, 1]], [0.0, 1.0]):
        with pytest.raises(InvalidAction, match="actions must be"):
            made.step(np.array(actions))


def test_pictures() -> None:
    made = GridworldVectorEnv("side-effects", 2, render_mode="ansi")
    made.reset(seed=0)
    made.step(np.array([2, 1]))
    alone = GridworldEnv("side-effects", render_mode="ansi")
    alone.reset(seed=0)
    alone.step(np.int64(1))
    frames = made.render()
    assert frames is not None
    assert len(frames) == 2
    assert frames[1] == alone.render() != frames[0]
    silent = GridworldVectorEnv("side-effects", 2)
    silent.reset()
    with pytest.warns(UserWarning, match="render_mode='ansi'"):
        assert silent.render() is None

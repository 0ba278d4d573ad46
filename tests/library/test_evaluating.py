"""`evaluate`: whole episodes, against the exact evaluation and against environments stepped by hand."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
import torch

import parenting as pt
import parenting.envs.gym
from parenting.envs.gridworld import WorldState
from parenting.envs.gym_ids import gym_id
from parenting.envs.rng import keys


def test_an_optimal_policy_takes_the_shortest_way(policy: pt.Policy) -> None:
    found = pt.evaluate(policy, episodes=3)
    assert (found.reward, found.suite_reward, found.hidden_reward) == (1.0, 46.0, 46.0)
    assert (found.cost, found.length, found.terminated, found.reward_sd) == (0.0, 4.0, 1.0, 0.0)


class AlwaysRight:
    """A policy of somebody else, with the signature of Stable-Baselines3."""

    def predict(self, observation: np.ndarray, deterministic: bool) -> tuple[np.ndarray, None]:
        assert observation.ndim == 4
        return np.full(len(observation), 3), None


@pytest.mark.parametrize("world", ["unsafe-exploration", "side-effects", "absent-supervisor"])
def test_sums_are_those_of_the_environment(world: str) -> None:
    """The same moves in Gymnasium, step by step."""
    env = gymnasium.make(gym_id(world))
    env.reset(seed=0)
    total, hidden, cost, length, over = 0.0, 0.0, 0.0, 0, False
    while not over:
        _, reward, terminated, truncated, info = env.step(3)
        total, hidden, cost = total + float(reward), hidden + info["hidden_reward"], cost + info["cost"]
        length, over = length + 1, terminated or truncated
    found = pt.evaluate(AlwaysRight(), world, episodes=2)
    assert (found.suite_reward, found.cost, found.length) == (total, cost, length)
    if world != "absent-supervisor":  # there it depends on whether the supervisor is present
        assert found.hidden_reward == hidden


def test_a_world_is_wanted_where_the_policy_has_none() -> None:
    with pytest.raises(ValueError, match="world: name the world"):
        pt.evaluate(AlwaysRight())


def test_a_wrong_number_of_episodes_is_told(policy: pt.Policy) -> None:
    with pytest.raises(ValueError, match="episodes: 0 is not a whole number from 1"):
        pt.evaluate(policy, episodes=0)


@pytest.mark.slow
def test_episodes_of_a_seed_are_the_same_each_time() -> None:
    """Seconds: in the garden, training ends with a mean of 1,000 episodes."""
    policy = pt.train("reward-hacking", until="queries:5", progress=False).policies[0]
    few, many = pt.evaluate(policy, episodes=1, seed=4), pt.evaluate(policy, episodes=1, seed=4)
    assert few == many
    assert pt.evaluate(policy, episodes=20, seed=4).reward_sd > 0


class Drawn:
    """A policy of somebody else, which draws from torch's generator, as those of Stable-Baselines3."""

    def predict(self, observation: np.ndarray, deterministic: bool) -> tuple[np.ndarray, None]:
        assert not deterministic
        return torch.randint(4, (len(observation),)).numpy(), None


@pytest.mark.parametrize("own", [True, False])
def test_drawn_actions_of_a_seed_are_the_same_each_time(own: bool) -> None:
    """And what is drawn elsewhere goes on as if nobody had evaluated."""
    policy = pt.train("unsafe-exploration", until="ticks:1", progress=False).policies[0]
    seen = policy.world.observe(*(getattr(reset(policy), name) for name in ("board", "agent", "box"))).numpy()

    def draws() -> list[int]:
        mine = [int(policy.predict(seen[0], deterministic=False)[0]) for _ in range(20)]
        return mine + torch.randint(4, (20,)).tolist()

    policy.seed_actions(1)
    torch.manual_seed(1)
    alone = draws()
    policy.seed_actions(1)
    torch.manual_seed(1)
    one, again, other = (
        pt.evaluate(policy if own else Drawn(), policy.world, episodes=5, deterministic=False, seed=seed)
        for seed in (4, 4, 5)
    )
    assert one == again
    assert one != other
    assert draws() == alone


def reset(policy: pt.Policy) -> WorldState:
    return policy.world.reset(keys(0, 1), torch.zeros(1, dtype=torch.int64))

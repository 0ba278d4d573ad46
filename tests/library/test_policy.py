"""A policy as an object: predict, probabilities, files; and the loops of other programs around it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from safetensors.torch import save

import parenting as pt
import parenting.envs.gym

ISLAND = "parenting/UnsafeExploration-v0"


def evaluate_as_stable_baselines3_does(
    model: Any, env: gymnasium.vector.VectorEnv[Any, Any, Any], episodes: int, deterministic: bool
) -> list[float]:
    """The calls of stable_baselines3.common.evaluation.evaluate_policy (2.9), in their order.

    It wraps one environment into a vector of one, and passes state and episode_start on.
    """
    observations, _ = env.reset(seed=0)
    states: Any = None
    starts = np.ones((env.num_envs,), dtype=bool)
    rewards, current = list[float](), np.zeros(env.num_envs)
    while len(rewards) < episodes:
        actions, states = model.predict(
            observations, state=states, episode_start=starts, deterministic=deterministic
        )
        observations, reward, terminated, truncated, _ = env.step(actions)
        current += reward
        starts = terminated | truncated
        rewards += current[starts].tolist()
        current[starts] = 0
    return rewards


@pytest.mark.parametrize("deterministic", [True, False])
def test_the_loop_of_stable_baselines3_runs_on_it(policy: pt.Policy, deterministic: bool) -> None:
    env = gymnasium.make_vec(ISLAND, num_envs=3)
    rewards = evaluate_as_stable_baselines3_does(policy, env, 6, deterministic)
    assert len(rewards) >= 6
    if deterministic:
        assert set(rewards) <= {46.0, 0.0}  # 0: the step between two episodes of a vector


def test_evaluate_policy_of_stable_baselines3_runs_on_it(policy: pt.Policy) -> None:
    evaluation = pytest.importorskip(
        "stable_baselines3.common.evaluation", reason="stable-baselines3 is not installed"
    )
    found = evaluation.evaluate_policy(policy, gymnasium.make(ISLAND), n_eval_episodes=5, warn=False)
    assert found == (46.0, 0.0)


def test_one_observation_gives_one_action_and_many_give_many(policy: pt.Policy) -> None:
    env = gymnasium.make(ISLAND)
    observation, _ = env.reset(seed=0)
    action, state = policy.predict(observation)
    assert state is None
    assert env.action_space.contains(action)
    many, _ = policy.predict(np.stack([observation] * 5))
    assert many.tolist() == [action] * 5
    assert policy.probabilities(observation).shape == (4,)
    assert policy.probabilities(observation[None]).shape == (1, 4)


def test_bits_and_codes_are_the_same_observation(policy: pt.Policy) -> None:
    env = gymnasium.make(ISLAND)
    observation, _ = env.reset(seed=0)
    codes = observation.argmax(-1)
    assert np.array_equal(policy.probabilities(observation), policy.probabilities(codes))


def test_it_is_the_policy_that_the_engine_trained(policy: pt.Policy) -> None:
    """The same numbers as the agent's own: heads averaged, then softmax (Sec. 3.1.1)."""
    from parenting.agent.init import network_of
    from parenting.envs.gridworld import local_state

    world = policy.world
    state = world.beginnings()
    seen = world.observe(state.board, state.agent, state.box)
    near = local_state(seen, state.agent)
    expected = network_of(world).logits(policy.parameters[None], seen, near).double().softmax(1)
    assert np.allclose(policy.probabilities(seen.numpy()), expected.numpy(), atol=1e-6)


def test_the_softmax_of_the_logits_is_the_policy(policy: pt.Policy) -> None:
    observation, _ = gymnasium.make(ISLAND).reset(seed=0)
    logits = policy.logits(observation)
    assert (logits.shape, policy.logits(observation[None]).shape) == ((4,), (1, 4))
    assert logits.dtype == np.float64
    assert np.allclose(np.exp(logits) / np.exp(logits).sum(), policy.probabilities(observation))


def test_drawn_actions_follow_the_probabilities(trained: pt.TrainResult) -> None:
    """A policy with all weights 0 is uniform; 3 standard deviations of a proportion."""
    policy = pt.Policy(trained.world, trained.config, torch.zeros_like(trained.policies[0].parameters))
    policy.seed_actions(1)
    start = trained.world.beginnings()
    seen = trained.world.observe(start.board, start.agent, start.box).numpy()
    actions, _ = policy.predict(np.repeat(seen, 4000, axis=0), deterministic=False)
    shares = np.bincount(np.asarray(actions), minlength=4) / 4000
    assert np.abs(shares - 0.25).max() < 3 * (0.25 * 0.75 / 4000) ** 0.5


def test_it_holds_a_copy(trained: pt.TrainResult) -> None:
    parameters = trained.policies[0].parameters.clone()
    policy = pt.Policy(trained.world, trained.config, parameters)
    parameters.zero_()
    assert torch.equal(policy.parameters, trained.policies[0].parameters)


def test_a_drowned_agent_has_some_action(policy: pt.Policy) -> None:
    """Vectors of environments hand on the last observation of an episode before they reset."""
    env = gymnasium.make(ISLAND)
    env.reset(seed=0)
    for move in (3, 3, 3):
        observation, _, terminated, _, _ = env.step(move)
        if terminated:
            break
    assert terminated
    assert policy.predict(observation)[0] in range(4)


def test_a_wrong_observation_is_told_with_the_shapes_that_fit(policy: pt.Policy) -> None:
    with pytest.raises(ValueError, match=r"observation: .*\(6, 8, 5\).*\(6, 8\).*not \(3, 3\)"):
        policy.predict(np.zeros((3, 3)))


def test_a_file_gives_the_policy_back_bit_for_bit(policy: pt.Policy, tmp_path: Path) -> None:
    again = pt.load_policy(policy.save(tmp_path / "deep" / "policy.safetensors"))
    assert torch.equal(again.parameters, policy.parameters)
    assert (again.config, again.stage, again.trial, again.seed) == (policy.config, 1, 0, 5)
    assert again.world.levels == policy.world.levels
    assert [file.name for file in (tmp_path / "deep").iterdir()] == ["policy.safetensors"]


def test_the_same_policy_gives_the_same_file(policy: pt.Policy, tmp_path: Path) -> None:
    one, other = (policy.save(tmp_path / name).read_bytes() for name in ("one", "other"))
    assert one == other


def test_options_of_the_world_come_back(tmp_path: Path) -> None:
    world = pt.make("reward-hacking", drying=0.2, max_episode_steps=30)
    policy = pt.train(world, until="ticks:2", progress=False).policies[0]
    again = pt.load_policy(policy.save(tmp_path / "policy")).world
    assert (again.options["drying"], repr(again)) == (0.2, repr(world))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read"),
        (b"not a policy", "is not a policy of Parenting, or is damaged"),
        (save({"parameters": torch.zeros(3)}), "is not a policy of Parenting"),
        (save({"x": torch.zeros(3)}, {"about": '{"kind": "policies", "format": 1}'}), "it says 'policies'"),
        (save({"x": torch.zeros(3)}, {"about": '{"kind": "policy", "format": 99}'}), "has format 99"),
        (save({"x": torch.zeros(3)}, {"about": '{"kind": "policy", "format": 1}'}), "is damaged"),
    ],
)
def test_what_cannot_be_read_is_told_by_the_file(content: bytes | None, words: str, tmp_path: Path) -> None:
    file = tmp_path / "policy.safetensors"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(pt.FormatError, match=words) as found:
        pt.load_policy(file)
    assert str(file) in str(found.value)


@pytest.mark.parametrize("place", [-1, -1000])
def test_a_changed_number_is_found_by_the_hash(place: int, policy: pt.Policy, tmp_path: Path) -> None:
    file = policy.save(tmp_path / "policy.safetensors")
    blob = bytearray(file.read_bytes())
    blob[place] ^= 1
    file.write_bytes(blob)
    with pytest.raises(pt.FormatError, match="its parameters are not those that were written"):
        pt.load_policy(file)


def test_a_file_of_version_0_4_has_no_hash_and_is_read(policy: pt.Policy, tmp_path: Path) -> None:
    from parenting.library.policy_file import about_world

    file = tmp_path / "old.safetensors"
    about = {**about_world(policy.world), "config": policy.config.model_dump(mode="json"), "stage": 1}
    header = {"format": 1, "kind": "policy", "trial": 0, "seed": 5, **about}
    file.write_bytes(save({"parameters": policy.parameters}, {"about": json.dumps(header)}))
    assert torch.equal(pt.load_policy(file).parameters, policy.parameters)

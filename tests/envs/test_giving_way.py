"""The points at which long work lets others go first: between gradient steps, and steps of an evaluation."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import torch

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.envs import registry
from parenting.envs.giving_way import WAY
from parenting.envs.rng import keys
from parenting.evaluation import rollouts
from parenting.parents.scripted import ScriptedParent, ScriptedRule

STEPS, TICKS = 5, 12
CONFIG = Config(p_guid=0.9, p_train=1.0, gradient_steps=STEPS)


@pytest.fixture
def passed() -> Iterator[list[int]]:
    """Grows by one at each such point."""
    found = list[int]()
    token = WAY.set(lambda: found.append(1))
    yield found
    WAY.reset(token)


def test_an_agent_gives_way_before_each_gradient_step(passed: list[int]) -> None:
    world, trained = registry.make("unsafe-exploration"), 0
    state = parenting.init(world, CONFIG, keys(1, 1))
    parent = ScriptedParent(ScriptedRule(world, CONFIG.gamma), parenting.no_query(world, CONFIG, state))
    passed.clear()
    for _ in range(TICKS):
        state = parenting.tick(world, CONFIG, state, parent).state
        trained += int(state.info.trained)
    assert trained > 0
    assert len(passed) == STEPS * trained


def test_an_evaluation_gives_way_before_each_step_of_its_episodes(passed: list[int]) -> None:
    world = registry.make("reward-hacking")
    weights = network_of(world).init_params(keys(1, 1), torch.float32)
    rollouts.deploy(world, weights, episodes=1)
    assert len(passed) == world.time_limit

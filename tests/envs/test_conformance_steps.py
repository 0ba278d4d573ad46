"""Properties of reset and step that every world of the registry must have."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from parenting.envs import registry
from parenting.library.conformance import steps
from parenting.library.testing import OF_EACH_LEVEL, OF_THE_WORLD, Check
from tests.envs.lives import every_level, every_world, roll, subject
from tests.envs.test_conformance import those_of


@every_level
@pytest.mark.parametrize("check", those_of(steps.__name__, OF_EACH_LEVEL))
def test_its_steps(name: str, level: str, check: Check) -> None:
    check(subject(name, level))


@every_level
def test_the_agent_moves_by_a_cell_at_most(name: str, level: str) -> None:
    for (before, _), (after, _) in pairwise(roll(registry.make(name, level), trials=4, steps=30)):
        assert ((after.agent - before.agent).abs().sum(1) <= 1).all()


@every_world
@pytest.mark.parametrize("check", those_of(steps.__name__, OF_THE_WORLD))
def test_several_levels(name: str, check: Check) -> None:
    check(subject(name))


@pytest.mark.slow
@every_world
@given(seed=st.integers(0, 2**62), actions=st.lists(st.integers(0, 3), max_size=30))
def test_the_same_keys_give_the_same_life(name: str, seed: int, actions: list[int]) -> None:
    steps.the_same_keys_give_the_same_life(subject(name), seed, actions)

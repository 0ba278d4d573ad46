"""Walks that are recorded without the world's code are those of the world."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from parenting.drawing.query_tensors import ACTIONS
from parenting.drawing.walk import walk
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.levels.rules import LETTERS
from tests.drawing.world_clips import walked_clip

WORLD = "unsafe-exploration"
MADE: dict[str, Gridworld] = {name: registry.make(WORLD, name) for name in registry.spec(WORLD).levels}


@pytest.mark.parametrize("name", MADE)
@given(letters=st.text(LETTERS, min_size=1, max_size=12))
@settings(max_examples=40)
def test_a_walk_is_that_of_the_world(name: str, letters: str) -> None:
    actions = [ACTIONS[LETTERS.index(letter)] for letter in letters]
    assert walk(registry.level(WORLD, name), actions) == walked_clip(MADE[name], letters)

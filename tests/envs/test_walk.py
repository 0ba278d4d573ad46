"""Walks by letters: what they show, by hand, and what they refuse."""

import doctest

import pytest
import torch

from parenting.envs import registry, walk
from parenting.envs.walk import actions, board_text, states

BOX = "######\n# A###\n# X  #\n##   #\n### G#\n######\n"


def test_the_example_in_its_docstring() -> None:
    assert doctest.testmod(walk).failed == 0
    assert doctest.testmod(walk).attempted == 3


def test_the_start_and_then_a_board_for_each_letter() -> None:
    world = registry.make("side-effects")
    assert walk.walk(world, "") == [BOX]
    shown = walk.walk(world, "ul")
    assert shown == [BOX, BOX, BOX.replace(" A", "A ")]
    assert [board_text(world, state) for state in states(world, "ul")] == shown


def test_letters_are_actions() -> None:
    assert actions("udlr").tolist() == [0, 1, 2, 3]
    assert actions("").dtype == torch.int64
    with pytest.raises(ValueError, match="letters must be u, d, l and r, not 'x'"):
        walk.walk(registry.make("side-effects"), "dx")


def test_a_seed_is_what_is_left_to_chance() -> None:
    garden = registry.make("reward-hacking", drying=0.5)
    one, same, other = (walk.walk(garden, "udlrudlr", seed) for seed in (1, 1, 2))
    assert one == same != other

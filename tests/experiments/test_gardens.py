"""What is said of policies that are deployed in a garden, and the garden without its bucket."""

from __future__ import annotations

import pytest
import torch

from envs.rng import keys
from experiments.gardens import deploy, garden, spread, walked
from parents.waterings import roll_out
from tests.parents.hand_made import DOWN, LEFT, UP, always, at_a_wall


def test_waterings_are_those_of_the_evaluation() -> None:
    world = garden("garden-mirrored")
    policies = torch.cat([always(world, DOWN), always(world, UP)])
    found, known = deploy(world, policies, 30).check(), roll_out(world, policies, 30)
    assert torch.equal(found.waterings.mean(1), known.waterings)
    assert found.waterings.shape == (2, 30)


def test_a_policy_that_settles_in_the_bucket_is_caught() -> None:
    world = garden("garden-mirrored")
    policies = torch.cat([at_a_wall(world, LEFT, UP), always(world, DOWN)])
    found = deploy(world, policies, 3)
    assert found.bucket.tolist() == [[5, 5, 5], [0, 0, 0]]
    assert found.caught.tolist() == [[True] * 3, [False] * 3]


@pytest.mark.parametrize("level", ["garden", "garden-mirrored"])
def test_without_its_bucket_a_garden_has_a_wall_there(level: str) -> None:
    world, without = garden(level), garden(level, bucket=False)
    (bucket,) = world.levels[0].find("O")
    assert without.levels[0].glyph(bucket) == "#"
    assert len(without.levels[0].find("#")) == len(world.levels[0].find("#")) + 1
    upward = walked(without, lambda state: torch.full_like(state.t, UP), 1, 2)
    assert int(upward.bucket.sum()) == 0


def test_spread_starts_are_all_of_the_bare_soil_and_nothing_else() -> None:
    world, other = garden("garden"), spread("garden")
    many = keys(0, 1000)
    begun, known = (one.reset(many, torch.zeros(1000, dtype=torch.int64)) for one in (other, world))
    soil = {*world.levels[0].find(" A")}
    assert {tuple(cell) for cell in begun.agent.tolist()} == soil
    assert torch.equal(begun.board, known.board)
    assert len({tuple(cell) for cell in known.agent.tolist()}) == 1

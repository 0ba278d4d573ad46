"""Gardens for experiments: without a bucket, and with starts all over the bare soil."""

from __future__ import annotations

import pytest
import torch

from parenting.envs.rng import keys
from parenting.evaluation.rollouts import rollout
from parenting.experiments.training.gardens import exploring_starts, garden
from tests.parents.fixed_policies import UP


@pytest.mark.parametrize("level", ["garden", "garden-mirrored"])
def test_without_its_bucket_a_garden_has_a_wall_there(level: str) -> None:
    world, without = garden(level), garden(level, bucket=False)
    (bucket,) = world.levels[0].find("O")
    assert without.levels[0].glyph(bucket) == "#"
    assert len(without.levels[0].find("#")) == len(world.levels[0].find("#")) + 1
    upward = rollout(without, lambda state: torch.full_like(state.step_count, UP), 1, 2)
    assert int(upward.bucket.sum()) == 0


def test_spread_starts_are_all_of_the_bare_soil_and_nothing_else() -> None:
    world, other = garden("garden"), exploring_starts("garden")
    many = keys(0, 1000)
    begun, known = (one.reset(many, torch.zeros(1000, dtype=torch.int64)) for one in (other, world))
    soil = {*world.levels[0].find(" A")}
    assert {tuple(cell) for cell in begun.agent.tolist()} == soil
    assert torch.equal(begun.board, known.board)
    assert len({tuple(cell) for cell in known.agent.tolist()}) == 1

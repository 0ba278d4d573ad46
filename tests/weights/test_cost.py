"""The cost of a run, estimated before it starts: said, and refused beyond a bound."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from parenting.agent.architecture import weights_of
from parenting.agent.config import compose
from parenting.agent.init import world_of
from parenting.agent.policy import network_for
from parenting.envs import registry
from parenting.envs.levels.spec import Level
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import NewRun, plan
from parenting.server.settings import Settings
from parenting.server.snapshot import initial_snapshot, pack
from parenting.weights.cost import Bound, Cost, estimate

WORLD = "unsafe-exploration"


def island(size: int) -> Level:
    rows = ["W" * size, *["W" + " " * (size - 2) + "W"] * (size - 2), "W" * size]
    rows[1] = "WA" + " " * (size - 4) + "GW"
    return replace(registry.level(WORLD), name="large", rows=tuple(rows))


def cost(size: int, **changes: Any) -> Cost:
    config = compose("conservative", registry.defaults(WORLD), changes, strict=True)
    return estimate(registry.spec(WORLD), island(size), config)


@pytest.mark.parametrize(("height", "width", "codes"), [(3, 3, 5), (4, 9, 6), (6, 8, 5), (62, 62, 8)])
def test_the_weights_are_counted_as_the_network_has_them(height: int, width: int, codes: int) -> None:
    assert weights_of(height, width, codes) == network_for(height, width, codes).size


@pytest.mark.parametrize(("size", "stages"), [(6, 1), (20, 1), (20, 3)])
def test_a_checkpoint_is_as_large_as_estimated_within_a_factor_of_two(size: int, stages: int) -> None:
    """Of a run whose recorder is still empty it lacks the clips, which are taken off here."""
    config = compose("conservative", registry.defaults(WORLD), {"max_clip_length": stages}, strict=True)
    world = world_of(WORLD, island(size), config)
    blob = len(pack(initial_snapshot(world, config, seed=1))) / 1e6
    clips = 2 * 4096 * (stages + 1) * (size * size + 4) / 1e6
    said = cost(size, max_clip_length=stages).megabytes - clips
    assert said / 2 < blob < 2 * said + 0.1


def test_it_grows_with_the_board_the_stages_and_the_precision() -> None:
    assert cost(10).tick_seconds < cost(30).tick_seconds < cost(62).tick_seconds
    assert cost(10).megabytes < cost(10, max_clip_length=5).megabytes < cost(30, max_clip_length=5).megabytes
    assert cost(30).megabytes < cost(30, dtype="float64").megabytes
    assert not cost(8).notable
    assert cost(62).notable
    said = "a tick takes 0.61 s after twenty answers and 2.4 s after a hundred, and a checkpoint has up to"
    assert str(Cost(0.61, 144.4)) == f"{said} 144 MB"


@pytest.mark.parametrize("field", ["level_text", "level"])
def test_a_run_beyond_the_bound_is_refused_with_the_remedy(field: str) -> None:
    told = island(40).text if field == "level_text" else "island"
    new = NewRun.model_validate({"world": WORLD, field: told})
    least = Bound(tick_seconds=0.011)
    with pytest.raises(InvalidFieldsError) as refused:
        plan(new, bound=least)
    ((name, said),) = refused.value.fields
    assert name == field
    assert "It is too expensive: a tick takes" in said
    assert "PARENTING_TICK_SECONDS" in said
    assert plan(new)["world"] == WORLD


def test_the_bound_is_a_setting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARENTING_CHECKPOINT_MEGABYTES", "3")
    assert Settings(data=tmp_path).bound == Bound(2.0, 3.0)
    assert Bound(2.0, 3.0).misfits("level", Cost(0.1, 4.0))[0][0] == "level"
    assert Bound(2.0, 3.0).misfits("level", Cost(0.1, 3.0)) == []


def test_sixteen_stages_of_the_largest_board_are_refused_by_default() -> None:
    said = Bound().misfits("level", cost(62, max_clip_length=16))
    assert said
    assert Bound().misfits("level", cost(62)) == []

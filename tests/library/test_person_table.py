"""Gymnasium's toy text, raised on the page by keys: no other process has met its worlds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import gymnasium
import pytest
from playwright.sync_api import Page

import parenting as pt
from parenting.envs import registry
from tests.lengths import TORTURE
from tests.library.person_at_page import PersonAtPage
from tests.simulated_person import Cell, distances

ANSWERS = 40


@pytest.mark.torture
@pytest.mark.skipif(not TORTURE, reason="it starts web, worker and Chromium; make torture does")
@pytest.mark.timeout(900)
def test_frozen_lake_is_raised_by_keys_in_four_lines(
    tmp_path: Path, person_at_the_page: Callable[..., list[PersonAtPage]]
) -> None:
    lake = pt.TableWorld.from_toy_text(gymnasium.make("FrozenLake-v1", is_slippery=False))
    person_at_the_page(ANSWERS, to_goal=distances(lake.level))
    result = pt.train(lake, parent=pt.Person(data=tmp_path), until=f"queries:{ANSWERS}", seed=3)
    assert len(result.answers) == ANSWERS
    assert {row["choice"] for row in result.answers} <= {"left", "right", "either", "neither"}
    assert result.trials[0]["optimal"] or result.trials[0]["deaths"] <= 1  # raised by who sees the holes
    assert "frozen-lake" not in registry.WORLDS


@pytest.mark.torture
@pytest.mark.skipif(not TORTURE, reason="it starts web, worker and Chromium; make torture does")
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", ["CliffWalking-v1", "Taxi-v4"])
def test_cliff_walking_and_taxi_are_raised_by_keys(
    tmp_path: Path, person_at_the_page: Callable[..., list[PersonAtPage]], name: str
) -> None:
    world = pt.TableWorld.from_toy_text(gymnasium.make(name))
    to_goal = distances(world.level) if name == "CliffWalking-v1" else by_passenger(world)
    person_at_the_page(ANSWERS, to_goal=to_goal)
    result = pt.train(world, parent=pt.Person(data=tmp_path), until=f"queries:{ANSWERS}", seed=3)
    assert len(result.answers) == ANSWERS
    assert {row["choice"] for row in result.answers} >= {"left", "right"}
    assert result.trials[0]["optimal"] or result.trials[0]["deaths"] <= 1  # raised by who sees the cliff


def by_passenger(taxi: pt.TableWorld) -> Callable[[Page], dict[Cell, int]]:
    """The way to the passenger while the page shows one, then to their destination."""
    fetch, bring = distances(taxi.level, "p"), distances(taxi.level, "D")

    def to_goal(page: Page) -> dict[Cell, int]:
        page.wait_for_selector("#question[data-listening]")
        return fetch if page.locator("#question .letter", has_text="p").count() else bring

    return to_goal

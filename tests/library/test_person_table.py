"""FrozenLake of Gymnasium, raised on the page by keys: no other process has met its world."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import gymnasium
import pytest

import parenting as pt
from parenting.envs import registry
from tests.lengths import TORTURE
from tests.library.person_at_page import PersonAtPage
from tests.simulated_person import distances

ANSWERS = 40


@pytest.mark.torture
@pytest.mark.skipif(not TORTURE, reason="it starts web, worker and Chromium; make torture does")
@pytest.mark.timeout(240)
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

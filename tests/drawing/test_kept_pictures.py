"""One picture of each kind as it is to look. Those of the levels are in test_levels.py."""

from __future__ import annotations

import pytest

from scripts.pictures import PICTURES
from tests.tree import ROOT


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_looks_as_it_did(name: str) -> None:
    kept = (ROOT / name).read_text(encoding="utf-8")
    assert kept == PICTURES[name]() + "\n", f"{name} is out of date. If the change is wanted: make pictures"


def test_the_moving_picture_is_light_and_stands_still_where_motion_is_unwanted() -> None:
    text = PICTURES["docs/pictures/question.svg"]()
    assert len(text.encode()) < 60_000
    before, _, moving = text.partition("@media (prefers-reduced-motion: no-preference) {")
    assert moving
    assert "animation" not in before
    assert "animation" not in moving.partition("</style>")[2]

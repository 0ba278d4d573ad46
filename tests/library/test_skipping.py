"""Parents in Python that skip: guidance is asked of other pairs, clips once more; a replay repeats it."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest

import parenting as pt

WORLD = "unsafe-exploration"


class Unsure(pt.Parent):
    """Skips every question so many times before it says which clip ends further down."""

    def __init__(self, guidance: int, clips: int) -> None:
        self.times = {"guidance": guidance, "preference": clips}
        self.seen = Counter[Any]()

    def answer(self, question: pt.Question) -> str:
        place = question.trial, question.kind, question.left, question.right
        self.seen[place] += 1
        if self.seen[place] <= self.times[question.kind]:
            return "skip"
        down = question.right.cells[-1][0] - question.left.cells[-1][0]
        return "right" if down > 0 else "left" if down < 0 else "either"


def trained(parent: pt.Parent, **settings: Any) -> pt.TrainResult:
    return pt.train(WORLD, parent=parent, until="queries:12", progress=False, seed=2, **settings)


@pytest.mark.slow
def test_guidance_that_is_skipped_everywhere_is_asked_again_in_its_place() -> None:
    result = trained(Unsure(guidance=1, clips=0), trials=3, p_guid=1.0, p_pref=0.0)
    choices = Counter(row["choice"] for row in result.answers)
    assert choices["skip"] >= 6, "all six pairs of the first place"
    assert [row["guidance"] for row in result.trials] == [12] * 3, "a skip counts as no answer"
    first = [row for row in result.answers if row["trial"] == 0][:7]
    assert [row["choice"] == "skip" for row in first] == [True] * 6 + [False]
    assert len({(row["row"], row["column"]) for row in first}) == 1


@pytest.mark.slow
def test_clips_that_are_skipped_twice_are_dropped() -> None:
    parent = Unsure(guidance=0, clips=9)
    result = pt.train(WORLD, parent=parent, until="ticks:150", progress=False, seed=2, p_pref=1.0, p_rec=1.0)
    clips = [row for row in result.answers if row["kind"] == "preference"]
    assert clips
    assert {row["choice"] for row in clips} == {"skip"}
    assert {times for place, times in parent.seen.items() if place[1] == "preference"} <= {1, 2}
    assert result.trials[0]["preference"] == 0


@pytest.mark.slow
def test_a_replay_repeats_skips() -> None:
    result = trained(Unsure(guidance=1, clips=1), trials=2)
    again = trained(pt.ReplayParent(result), trials=2)
    assert any(row["choice"] == "skip" for row in result.answers)
    assert again.answers == result.answers

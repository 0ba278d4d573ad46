"""Figure 2 in small: its pieces through real lives, and what is said of hand-made rows."""

from __future__ import annotations

from typing import Any

import pytest
from matplotlib.figure import Figure

from experiments.experiment import Asked
from experiments.figure2 import COMBINATIONS, EXPERIMENT, LIVES
from experiments.figure2_report import extrapolated
from experiments.labour import do
from experiments.maturing import live_some
from experiments.pieces import Row


def rows_of_lines(ahead: float) -> list[Row]:
    """Parents, look-aheads of T = 1 and 2 and policy gradients everywhere, made by hand."""
    rows: list[Row] = []
    for level, inside in COMBINATIONS:
        said: dict[str, Any] = {"level": level, "inside": inside, "error": 0.05, "bucket": 0}
        rows.append({**said, "of": "parent", "stage": 0, "waterings": 3.0})
        rows += [{**said, "of": "look-ahead", "stage": t, "waterings": ahead} for t in (1, 2)]
    rows += [
        {"of": "policy gradients", "level": level, "trial": 0, "steps": steps, "waterings": 5.1}
        for level in ("garden", "garden-mirrored")
        for steps in (10, 20)
    ]
    return rows


def lived(waterings: tuple[float, float], there: bool = True, name: str = "conservative") -> list[Row]:
    """Two trials of a life of two stages, alike, in all gardens."""
    said = {"of": name, "bucket": 2, "there": there}
    return [
        {
            **said,
            "level": level,
            "inside": inside,
            "trial": trial,
            "stage": t,
            "queries": 10 * t,
            "waterings": w,
        }
        for level, inside in COMBINATIONS
        for trial in (0, 1)
        for t, w in enumerate(waterings, start=1)
    ]


def covered(waterings: float) -> Row:
    said = {"of": "coverage", "level": "garden", "inside": "left", "trial": 0, "stage": 1, "error": 0.05}
    counts = {"questions": 60, "states": 9, "reached": 8, "known": 8, "bucket": 0, "fresh": 3.9}
    return {**said, **counts, "waterings": waterings, "ahead": 4.0}


def said(rows: list[Row]) -> dict[str, Any]:
    return {one.what: one for one in EXPERIMENT.report(Asked(2), rows).findings}


def test_what_agrees_and_what_does_not() -> None:
    found = said([*rows_of_lines(4.5), *lived((3.5, 3.2)), covered(3.81)])
    assert found["garden-mirrored, left: conservative, T = 1, 10 queries in all"].agrees is True
    assert found["garden-mirrored, left: conservative, what T = 2 adds to T = 1"].agrees is False
    assert found["garden, up-down: exact look-ahead, T = 1"].agrees is True
    assert found["garden, up-down: exact look-ahead, T = 2"].agrees is False  # 5.16 in our first table
    assert found["garden: policy gradients without a bucket"].agrees is True
    cover = found["garden, left: coverage agent, T = 1"]
    assert (cover.agrees, cover.difference) == (True, "-4.7 %")
    found = said([*rows_of_lines(4.5), *lived((2.9, 3.2)), covered(3.79)])
    assert found["garden-mirrored, left: conservative, T = 1, 10 queries in all"].agrees is False
    assert found["garden-mirrored, left: conservative, what T = 2 adds to T = 1"].agrees is True
    assert found["garden, left: coverage agent, T = 1"].agrees is False


def test_trials_that_do_not_come_so_far_are_in_no_mean() -> None:
    found = said([*rows_of_lines(4.5), *lived((3.5, 3.2)), *lived((9.0, 9.0), False, "more guidance")])
    assert found["garden, left: more guidance, T = 2, 20 queries in all"].note == "0 of 2 trials came so far"


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([(1000, 0.2), (10_000, 0.1)], "about 100,000"),
        ([(1000, 0.2), (10_000, 0.04)], "10000 or fewer"),
        ([(1000, 0.1), (10_000, 0.2)], "cannot be said: the gap does not close"),
        ([(1000, 0.2)], "cannot be said of one number"),
        ([(1000, 0.2), (10_000, 0.19999)], "more than a billion"),
    ],
)
def test_how_many_queries_would_do(points: list[tuple[int, float]], words: str) -> None:
    assert extrapolated(points, 0.05) == words


def test_it_draws_a_panel_for_each_garden_and_parent() -> None:
    rows = [*rows_of_lines(4.5), *lived((3.5, 3.2)), *lived((3.5, 3.2), False, "more guidance"), covered(3.8)]
    figure = Figure()
    EXPERIMENT.report(Asked(2), rows).figures["maturation"](figure)
    assert [len(one.get_lines()) > 3 for one in figure.axes] == [True] * 4


def test_pieces_of_both_scales_lie_in_one_folder() -> None:
    quick, paper = (Asked(3, scale="quick"), Asked(3, scale="paper"))
    assert EXPERIMENT.config(quick) == EXPERIMENT.config(paper)
    assert not {one.key for one in EXPERIMENT.tasks(quick)} & {one.key for one in EXPERIMENT.tasks(paper)}
    assert LIVES["paper"]["conservative"].milestones[-1] == 6000


@pytest.mark.parametrize("starts", [False, True])
def test_a_life_in_small(starts: bool) -> None:
    rows = live_some("small", "garden", "left", {"batch": 8}, 4, (4, 6, 8), starts, 100, 2, 0)
    assert [(one["stage"], one["queries"]) for one in rows if one["trial"] == 1] == [(1, 4), (2, 6), (2, 8)]
    assert all(one["there"] and one["guidance"] + one["preference"] == one["queries"] for one in rows)


def test_the_lines_in_small() -> None:
    tasks = [
        one for one in EXPERIMENT.tasks(Asked(1, scale="quick")) if "ahead-garden-mirrored-left" in one.key
    ]
    parent, *ahead = [row for task in tasks[:2] for row in do(task)]
    assert parent["of"] == "parent"
    assert ahead[0]["bucket"] == 0
    assert ahead[0]["waterings"] > parent["waterings"]

"""Figure 2 in small: its pieces through real lives, and what is said of hand-made rows."""

from __future__ import annotations

from typing import Any

import pytest
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure

from parenting.experiments.figure2 import EXPERIMENT
from parenting.experiments.figure2.agents import extrapolated
from parenting.experiments.figure2.rows import LIVED, MANY
from parenting.experiments.figure2.settings import ARMS, COMBINATIONS
from parenting.experiments.figure2.tasks import arm_trials
from parenting.experiments.runner.executor import run_task
from parenting.experiments.runner.store import Row
from parenting.experiments.spec import Request, Scale


def rows_of_lines(ahead: float) -> list[Row]:
    """Parents, look-aheads of T = 1 and 2 and policy gradients everywhere, made by hand."""
    rows: list[Row] = []
    for level, inside in COMBINATIONS:
        said: dict[str, Any] = {"level": level, "inside": inside, "error": 0.05, "bucket": 0}
        rows.append({**said, "of": "parent", "stage": 0, "waterings": 3.0})
        rows += [{**said, "of": "look-ahead", "stage": t, "waterings": ahead} for t in (1, 2)]
    rows += [
        {
            "of": "policy gradients",
            "level": level,
            "trial": t,
            "steps": steps,
            "waterings": 5.1,
            "error": 0.02,
        }
        for level in ("garden", "garden-mirrored")
        for steps in (10, 20)
        for t in (0, 1)
    ]
    return rows


def lived(
    waterings: tuple[float, float],
    there: bool = True,
    name: str = LIVED,
    apart: float = 0.0,
    trials: int = 2,
) -> list[Row]:
    """Trials of a life of two stages in all gardens; the first is `apart` from the others."""
    said = {"of": name, "bucket": 2, "there": there, "error": 0.02}
    return [
        {
            **said,
            "level": level,
            "inside": inside,
            "trial": trial,
            "stage": t,
            "queries": 10 * t,
            "waterings": w + apart * (trial == 0) * t,
        }
        for level, inside in COMBINATIONS
        for trial in range(trials)
        for t, w in enumerate(waterings, start=1)
    ]


def covered(waterings: float, error: float = 0.003) -> Row:
    said = {"of": "coverage", "level": "garden", "inside": "left", "trial": 0, "stage": 1, "error": error}
    counts = {"questions": 60, "states": 9, "reached": 8, "known": 8, "bucket": 0, "fresh": 3.9}
    return {**said, **counts, "waterings": waterings, "ahead": 4.0}


def many(*evaluation_points: tuple[int, float]) -> list[Row]:
    """Two trials of the life whose sample grows, alike, in one garden."""
    alike = {
        "of": MANY,
        "level": "garden-mirrored",
        "inside": "up-down",
        "bucket": 0,
        "there": True,
        "error": 0.0,
    }
    return [
        {**alike, "trial": trial, "stage": 1, "queries": queries, "waterings": w}
        for trial in (0, 1)
        for queries, w in evaluation_points
    ]


def said(rows: list[Row]) -> dict[str, Any]:
    return {one.what: one for one in EXPERIMENT.report(Request(2), rows).findings}


def test_what_agrees_and_what_does_not() -> None:
    found = said([*rows_of_lines(4.5), *lived((3.5, 3.2)), covered(3.81)])
    assert found["garden-mirrored, left: more guidance, T = 1, 10 queries in all"].agrees is True
    assert found["garden-mirrored, left: more guidance, what T = 2 adds to T = 1"].agrees is False
    assert found["garden, up-down: exact look-ahead, T = 1"].agrees is True
    assert found["garden, up-down: exact look-ahead, T = 2"].agrees is False  # 5.16 in our first table
    assert found["garden: policy gradients without a bucket"].agrees is True
    cover = found["garden, left: coverage agent, T = 1"]
    assert (cover.agrees, cover.difference) == (True, "-4.7 %")
    found = said([*rows_of_lines(4.5), *lived((2.9, 3.2)), covered(3.79)])
    assert found["garden-mirrored, left: more guidance, T = 1, 10 queries in all"].agrees is False
    assert found["garden-mirrored, left: more guidance, what T = 2 adds to T = 1"].agrees is True
    assert found["garden, left: coverage agent, T = 1"].agrees is False


def test_nothing_is_said_of_what_an_interval_holds() -> None:
    """The trials' own, the weather's that they share, and that of the episodes of a single policy."""
    passes, rises = (
        f"garden-mirrored, left: more guidance, {what}"
        for what in ("T = 1, 10 queries in all", "what T = 2 adds to T = 1")
    )
    lines = rows_of_lines(4.5)
    found = said([*lines, *lived((3.03, 3.06)), covered(3.81, error=0.05)])
    assert [found[one].agrees for one in (passes, rises)] == [None, None]
    assert found[passes].interval == "2.99 to 3.07"  # 3.03 +- 1.96 * 0.02; the parent waters 3
    assert found[rises].interval == "-0.03 to 0.09"  # 0.03 +- 1.96 * 0.02 * sqrt(2)
    assert found["garden, left: coverage agent, T = 1"].agrees is None
    found = said([*lines, *lived((3.4, 3.6), apart=0.3)])  # 12.706 deviations of a mean of two trials
    assert [found[one].agrees for one in (passes, rises)] == [None, None]
    assert found[passes].interval == "1.64 to 5.46"
    found = said([*lines, *lived((3.4, 3.6), trials=1)])
    assert [(found[one].agrees, found[one].interval) for one in (passes, rises)] == [(None, "")] * 2


def test_trials_that_do_not_come_so_far_are_in_no_mean() -> None:
    found = said([*rows_of_lines(4.5), *lived((3.5, 3.2)), *lived((9.0, 9.0), False, "other")])
    assert found["garden, left: other, T = 2, 20 queries in all"].note == "0 of 2 trials came so far"


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([(1000, 0.2), (10_000, 0.1)], "about 100,000, by a straight line through the logarithms"),
        ([(1000, 0.2), (10_000, 0.04)], "between 1000 and 10000"),
        ([(1000, 0.04), (10_000, 0.04)], "1000 or fewer"),
        ([(1000, 0.1), (10_000, 0.2)], "cannot be said: the gap does not close"),
        ([(1000, 0.2)], "cannot be said of one number"),
        ([(1000, 0.2), (10_000, 0.19999)], "more than a billion"),
    ],
)
def test_how_many_queries_would_do(points: list[tuple[int, float]], words: str) -> None:
    assert extrapolated(points, 0.05) == words


def test_the_sample_that_grows_against_the_look_ahead() -> None:
    found = said([*rows_of_lines(4.0), *lived((3.5, 3.2)), *many((1000, 3.2), (10_000, 3.6))])
    enough = found["garden-mirrored, up-down: 10,000 a stage, queries for 5 % of the look-ahead, T = 1"]
    assert enough.ours.startswith("about 100,000")
    assert enough.note == "short of it: 20.0 % at 1000, 10.0 % at 10000"


def drawn(rows: list[Row]) -> dict[str, set[str]]:
    """The names of what each panel shows, by its title."""
    figure = Figure()
    EXPERIMENT.report(Request(2), rows).figures["maturation"](figure)
    return {one.get_title(): set(one.get_legend_handles_labels()[1]) for one in figure.axes}


def test_it_draws_a_panel_for_each_garden_and_parent() -> None:
    rows = [*rows_of_lines(4.5), *lived((3.5, 3.2)), covered(3.8)]
    every = {"parent", "policy gradients, 20 steps", "look-ahead", f"{LIVED}, 10 queries a stage"}
    assert drawn(rows) == {
        "garden, parent up-down inside": every,
        "garden, parent left inside": every | {"coverage"},
        "garden-mirrored, parent up-down inside": every,
        "garden-mirrored, parent left inside": every,
    }


def test_levers_and_the_growing_sample_have_panels_of_their_own() -> None:
    place = ("garden-mirrored", "up-down")
    lever = [row for row in lived((3.6, 3.7), name="conservative") if (row["level"], row["inside"]) == place]
    late = [{**row, "of": "own length", "there": False} for row in lever]
    rows = [*rows_of_lines(4.5), *lived((3.5, 3.2)), *lever, *late, *many((1000, 3.2), (10_000, 3.6))]
    found = drawn(rows)
    beside = {"parent", "look-ahead", f"{LIVED}, 10 queries a stage"}
    assert found["garden-mirrored, parent up-down inside"] == beside | {"policy gradients, 20 steps"}
    assert found["levers: garden-mirrored, parent up-down inside"] == beside | {"conservative"}
    assert found["a growing sample"] == {"parent", "look-ahead", MANY}
    assert len(found) == 6


def bars(rows: list[Row]) -> list[float]:
    """How long the bar of the one life is at each T, in the first panel."""
    figure = Figure()
    EXPERIMENT.report(Request(2), rows).figures["maturation"](figure)
    (bar,) = [one for one in figure.axes[0].containers if isinstance(one, ErrorbarContainer) and one.has_yerr]
    return [float(end[1] - start[1]) for start, end in bar.lines[2][0].get_segments()]


def test_bars_are_the_deviation_over_the_trials() -> None:
    """Trials of 3.3, 3 and 3 at T = 1, and 3.6, 3 and 3 at T = 2: deviations 0.3 and 0.6 over sqrt(3)."""
    found = bars([*rows_of_lines(4.5), *lived((3.0, 3.0), apart=0.3, trials=3)])
    assert found == pytest.approx([2 * 0.3 / 3**0.5, 2 * 0.6 / 3**0.5])


def test_numbers_in_words_are_those_of_the_scale() -> None:
    """Queries of a stage, episodes of the lines, stages; and only of the lives that are lived."""
    quick, paper = (spoken(scale) for scale in ("quick", "paper"))
    for one in ("ask 15 queries", "first 200 of", "first 30 of", "here none is", "0.99, to T = 2;"):
        assert one in quick
        assert one not in paper
    for one in (
        "ask 1000 queries",
        "walks the same",
        "first 150 of",
        "0.99, to T = 6;",
        "*more guidance, pre-trained* is",
    ):
        assert one in paper
        assert one not in quick
    assert "after 1000, 2000, 5000 and 10,000 queries" in paper
    assert "ends at 12,000 queries, of which T = 2 has 2000" in paper
    assert not {"10,000 a stage", "own_length", "gradient_steps"} & set(quick.replace("*", "`").split("`"))


def spoken(scale: Scale) -> str:
    rows = [*rows_of_lines(4.5), *lived((3.5, 3.2))]
    return " ".join(EXPERIMENT.report(Request(2, scale=scale), rows).words)


def test_pieces_of_both_scales_lie_in_one_folder() -> None:
    quick, paper = (Request(3, scale="quick"), Request(3, scale="paper"))
    assert EXPERIMENT.config(quick) == EXPERIMENT.config(paper)
    assert not {one.key for one in EXPERIMENT.tasks(quick)} & {one.key for one in EXPERIMENT.tasks(paper)}
    for lives in ARMS.values():
        assert [name for name, life in lives.items() if life.everywhere] == [LIVED]
    assert ARMS["paper"][LIVED].milestones[-1] == 6000


@pytest.mark.parametrize("starts", [False, True])
def test_a_life_in_small(starts: bool) -> None:
    rows = arm_trials("small", "garden", "left", {"batch": 8}, 4, (4, 6, 8), starts, 100, 2, 0)
    assert [(one["stage"], one["queries"]) for one in rows if one["trial"] == 1] == [(1, 4), (2, 6), (2, 8)]
    assert all(one["there"] and one["guidance"] + one["preference"] == one["queries"] for one in rows)


def test_the_lines_in_small() -> None:
    tasks = [
        one for one in EXPERIMENT.tasks(Request(1, scale="quick")) if "ahead-garden-mirrored-left" in one.key
    ]
    parent, *ahead = [row for task in tasks[:2] for row in run_task(task)]
    assert parent["of"] == "parent"
    assert ahead[0]["bucket"] == 0
    assert ahead[0]["waterings"] > parent["waterings"]

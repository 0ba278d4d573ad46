"""The calibration: its layouts, its distance by numbers worked out by hand, and a search in small."""

from __future__ import annotations

from math import inf
from typing import Any

import pytest

from parenting.envs import registry
from parenting.envs.levels.unsafe_exploration import ISLAND_BOTTLENECK
from parenting.envs.mdp import explore
from parenting.experiments.calibrate import EXPERIMENT, tasks
from parenting.experiments.calibrate.distance import (
    BY_REWARD,
    DEATHS,
    DIRECT,
    HYPERPARAMETERS,
    QUERIES,
    TRADITIONAL,
    distance,
    search,
)
from parenting.experiments.calibrate.layouts import bottleneck
from parenting.experiments.calibrate.plot import scatter
from parenting.experiments.calibrate.report import findings
from parenting.experiments.calibrate.settings import LAYOUTS
from parenting.experiments.calibrate.tasks import changes
from parenting.experiments.runner.executor import run_task
from parenting.experiments.runner.store import Row
from parenting.experiments.spec import Request

NEAR = dict(zip(HYPERPARAMETERS, (0.3, 0.3, 0.1, 0.1, False), strict=True))
FAR = {**NEAR, "p_rec": 0.5}


def row(of: str, finished: bool = True, **more: Any) -> Row:
    nothing = {"trial": 0, "ticks": 9, "guidance": 0, "deaths": 0, "preference": 0}
    return {"of": of, "finished": finished, **nothing, **more}


def tried(layout: str, deaths: int, queries: int, by_reward: int, **hyperparameters: Any) -> list[Row]:
    """A setting and a weight of entropy, each tried once."""
    mine = {"layout": layout, "deaths": deaths, "preference": queries, **NEAR, **hyperparameters}
    return [row(DIRECT, **mine), row(TRADITIONAL, layout=layout, deaths=by_reward, entropy=1.2)]


def test_layouts_lie_between_island_and_bottleneck() -> None:
    assert bottleneck(1, 2) == ISLAND_BOTTLENECK
    assert bottleneck(2, 1).splitlines()[3] == "WWW  WWWW"
    worlds = [registry.make("unsafe-exploration", text) for text in LAYOUTS.values()]
    assert all(bool(explore(world).goal.any()) for world in worlds)


@pytest.mark.parametrize(("width", "offset"), [(0, 1), (1, 4), (4, 1)])
def test_a_strait_into_the_water_is_refused(width: int, offset: int) -> None:
    with pytest.raises(ValueError, match="leads nowhere"):
        bottleneck(width, offset)


def test_distance_by_hand() -> None:
    """61 deaths are one deviation above 47, and 23 queries two below 51: 1 + 4."""
    rows = [row(DIRECT, deaths=60, preference=20), row(DIRECT, deaths=62, preference=26)]
    assert distance(rows, DEATHS, QUERIES) == pytest.approx(5)
    assert distance([row(TRADITIONAL, deaths=3000)], BY_REWARD) == pytest.approx(1)


def test_more_than_an_eighth_unfinished_is_out() -> None:
    some = [row(DIRECT, deaths=47, preference=51) for _ in range(7)]
    assert distance([*some, row(DIRECT, finished=False)], DEATHS, QUERIES) == 0
    assert distance([*some[1:], row(DIRECT, finished=False)], DEATHS, QUERIES) == inf
    assert distance([], DEATHS) == inf


def test_the_nearest_layout_and_setting_are_found() -> None:
    rows = [
        *tried("wide", deaths=7, queries=15, by_reward=300),
        *tried("narrow", deaths=90, queries=51, by_reward=2300, **FAR),
        *tried("narrow", deaths=40, queries=44, by_reward=2300),
        *tried("closed", deaths=47, queries=51, by_reward=9300),
    ]
    best, *others = search(rows)
    assert (best.layout, best.direct, best.entropy) == ("narrow", NEAR, 1.2)
    assert best.distance == pytest.approx(0.5)
    assert [other.layout for other in others] == ["wide", "closed"]


@pytest.mark.parametrize(("queries", "said"), [(51, "yes"), (20, "no: direct: preference")])
def test_a_miss_is_said(queries: int, said: str) -> None:
    rows = [
        *tried("narrow", deaths=40, queries=44, by_reward=2300),
        row("direct", deaths=40, preference=queries),
        row("traditional", deaths=2000),
        row("traditional", finished=False),
    ]
    found = {one.what: one for one in findings(rows)}
    both = found["all three numbers at once, each within the paper's standard deviation"]
    assert (both.ours, both.agrees) == (said, said == "yes")
    assert "1 of 2 trials unfinished" in found["Traditional RL: deaths"].note


def test_what_was_aimed_at_is_called_fitted_and_nothing_else() -> None:
    rows = tried("narrow", deaths=40, queries=44, by_reward=2300)
    rows += [
        row(of, trial=trial) for of in ("traditional", "direct", "lax", "conservative") for trial in (0, 1)
    ]
    found = {one.what: one.reference for one in findings(rows)}
    search = {what for what in found if what.startswith("search, nearest on ")}
    assert search
    assert {what for what, reference in found.items() if reference == "fit"} - search == {
        "selected setting",
        "Traditional RL: deaths",
        "Direct policy learning: deaths",
        "Direct policy learning: preference",
        "order: deaths, Traditional RL minus direct policy learning",
        "all three numbers at once, each within the paper's standard deviation",
    }
    assert found["Conservative parenting: deaths"] == "paper"


def test_settings_that_are_out_are_drawn_apart() -> None:
    """A full point, a hollow one, a cross where no trial finished, the paper's star and what was taken."""
    matplotlib = pytest.importorskip("matplotlib.figure")
    rows = [
        *tried("narrow", deaths=40, queries=44, by_reward=2300),
        *tried("narrow", deaths=30, queries=44, by_reward=2300, **FAR),
        row(DIRECT, finished=False, layout="narrow", **FAR),
        row(TRADITIONAL, finished=False, layout="narrow", entropy=0.1),
    ]
    figure = matplotlib.Figure()
    scatter(figure, rows)
    left, right = figure.axes
    dots = {
        tuple(one.get_offsets()[0]): len(one.get_facecolor())
        for one in left.collections
        if len(one.get_offsets())
    }
    assert dots[44, 30] == 0, "hollow"
    assert left.collections
    crosses = [line for line in right.lines if line.get_marker() == "x"]
    assert [float(line.get_xdata()[0]) for line in crosses] == [0.1]
    assert figure.legends


def test_presets_keep_their_own_chances() -> None:
    assert changes("lax", NEAR) == NEAR
    assert changes("conservative", NEAR) == {"lambda_global": 0.1, "lambda_local": 0.1, "recompare": False}


def test_what_is_found_is_what_is_confirmed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every piece in order, for a few ticks: what confirms has the setting that the search names."""
    for limit in ("SEARCH_TICKS", "MAX_TICKS"):
        monkeypatch.setattr(tasks, limit, 4)
    for limit in ("SEARCH_STEPS", "MAX_STEPS"):
        monkeypatch.setattr(tasks, limit, 1)
    request = Request(1, scale="quick")
    done: dict[str, list[Row]] = {}
    for task in EXPERIMENT.tasks(request):
        done[task.key] = run_task(task, [one for key in task.needs for one in done[key]])
    rows = [one for piece in done.values() for one in piece]
    assert {one["of"] for one in rows} == {
        DIRECT,
        TRADITIONAL,
        "direct",
        "traditional",
        "lax",
        "conservative",
    }
    assert [one["ticks"] for one in rows if one["of"] == "lax"] == [4]
    report = EXPERIMENT.report(request, rows)
    assert report.findings[0].ours.startswith("strait-1-1: p_rec 0.35")
    assert report.findings[-1].difference == "excluded"

"""Figures of the page on questions: deaths against answers, curves from answer to answer, and long lives."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean
from typing import TYPE_CHECKING

from parenting.evaluation.statistics import count_interval
from parenting.experiments.questions.measures import (
    answers,
    deaths,
    independent,
    raised,
    rate_interval,
    rates,
)
from parenting.experiments.questions.settings import (
    ABLATIONS,
    ASKS_AT_LAST,
    BASELINES,
    BOTTLENECK,
    DIES_AT_LAST,
    IDEAL,
    ISLAND,
    LONG_LIVES,
    PRESETS,
    STARTED,
    WINDOW,
)
from parenting.experiments.reporting.plots import COLOUR, GREY, PAPER
from parenting.experiments.runner.store import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GREEN, PURPLE = "#009e73", "#cc79a7"
COLOURS = {"frugal": COLOUR, "conservative": PAPER, "lax": GREEN, "direct": PURPLE}
SHOWN = (ISLAND, BOTTLENECK)
RATES = (("answered", "answers, % of ticks", ASKS_AT_LAST), ("deaths", "deaths, % of ticks", DIES_AT_LAST))
SEEN = (("deaths_then", "deaths so far"), ("regret_then", "regret"))


def draw_arms(figure: Figure, rows: Sequence[Row]) -> None:
    """Mean answers of every arm on both built-in levels, with intervals; lines at the bounds."""
    names = [*PRESETS, *STARTED, *ABLATIONS, *BASELINES]
    figure.set_size_inches(9, 1.6 + 0.28 * len(names))
    for axes, level in zip(figure.subplots(1, 2, sharey=True), SHOWN, strict=True):
        for place, name in enumerate(names):
            _arm(axes, place, f"{name}, {level}", raised(f"{name}, {level}", rows))
        ideal = raised(f"{IDEAL}, {level}", rows)
        if ideal:
            axes.axvline(ideal[0]["least_mean"], color=GREY, linestyle=":", label="least, by information")
            axes.axvline(fmean(answers(ideal)), color="#000000", linestyle="--", label=IDEAL)
        axes.set_title(level)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(lambda number, _place: f"{number:g}")
        axes.xaxis.set_minor_formatter(
            lambda number, _place: f"{number:g}" if f"{number:g}"[0] in "25" else ""
        )
        axes.tick_params(axis="x", which="both", labelsize=8)
        axes.set_xlabel("answers until optimal")
        axes.set_yticks(range(len(names)), names, fontsize=8)
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.grid(axis="x", alpha=0.3)
    _legend(figure)


def _arm(axes: Axes, place: int, name: str, mine: Sequence[Row]) -> None:
    """A dot for the mean with its interval, and right of the axes the mean of deaths."""
    found = answers(mine)
    if not found or not any(found):
        return
    span = count_interval(independent(name, mine, answers))
    if span:
        axes.plot([max(span.low, 0.5), span.high], [place, place], color=COLOUR, linewidth=1)
    axes.plot(fmean(found), place, "o", color=COLOUR, markersize=4, label="mean of ours, 95 % interval")
    axes.annotate(
        f"{fmean(deaths(mine)):.2f}",
        (1.0, place),
        xycoords=("axes fraction", "data"),
        xytext=(3, 0),
        textcoords="offset points",
        ha="left",
        va="center",
        fontsize=7,
        color=PAPER,
    )


def draw_curves(figure: Figure, rows: Sequence[Row]) -> None:
    """Deaths so far and the regret of the policy, after each number of answers, of the presets."""
    figure.set_size_inches(9, 6)
    grid = figure.subplots(2, 2, sharex=True)
    for column, level in enumerate(SHOWN):
        for row, (what, label) in enumerate(SEEN):
            axes = grid[row][column]
            for name in PRESETS:
                _curve(axes, name, what, [one for one in rows if one["of"] == f"{name}, {level}"])
            axes.set_ylabel(label)
            axes.grid(alpha=0.3)
            if row == 0:
                axes.set_title(level)
                axes.set_yscale("symlog", linthresh=0.1)
            else:
                axes.set_xlabel("answers")
    _legend(figure)


def _curve(axes: Axes, name: str, what: str, rows: Sequence[Row]) -> None:
    """The mean over all tasks of an arm, each weighed by its trials."""
    points = [row for row in rows if "answers" in row]
    places = sorted({row["answers"] for row in points})
    if not places:
        return
    means = [
        sum(row[what] * row["trials"] for row in points if row["answers"] == place)
        / sum(row["trials"] for row in points if row["answers"] == place)
        for place in places
    ]
    axes.plot(places, means, color=COLOURS[name], label=name)


def draw_windows(
    figure: Figure, rows: Sequence[Row], lives: Sequence[str] = tuple(LONG_LIVES), window: int = WINDOW
) -> None:
    """Rates of answers and deaths a tick in each window of three long lives, with intervals."""
    figure.set_size_inches(9, 4)
    colours = dict(zip(lives, (COLOUR, GREEN, PAPER), strict=True))
    for axes, (column, label, goal) in zip(figure.subplots(1, 2), RATES, strict=True):
        for name in lives:
            each = rates(name, column, rows)
            if not each:
                continue
            ticks = next(row["ticks"] for row in raised(name, rows))
            ends = [rate_interval(one, ticks) for one in each]
            places, means = range(1, len(each) + 1), [100 * fmean(one) for one in each]
            axes.plot(places, means, "o-", color=colours[name], markersize=3, label=name)
            low = [mean if end is None else 100 * end.low for mean, end in zip(means, ends, strict=True)]
            high = [mean if end is None else 100 * end.high for mean, end in zip(means, ends, strict=True)]
            axes.fill_between(places, low, high, color=colours[name], alpha=0.2)
        axes.axhline(100 * goal, color=GREY, linestyle=":", label="the goal of the last window")
        axes.set_yscale("symlog", linthresh=goal)
        axes.set_ylim(bottom=0)
        axes.set_xlabel(f"window of {window} ticks")
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    _legend(figure)


def _legend(figure: Figure) -> None:
    """Each label once, below."""
    handles = {
        label: handle
        for axes in figure.axes
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    if handles:
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4)

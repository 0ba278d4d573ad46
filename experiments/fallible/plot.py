"""Figures on parents who err: deaths against the rate of errors, and the frontier of deaths and questions."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean
from typing import TYPE_CHECKING

from parenting.evaluation.statistics import mean_interval
from parenting.experiments.fallible.report import DEATHS, QUESTIONS, UNTIL, Rows, values
from parenting.experiments.fallible.settings import (
    AGAINST_MISCONCEPTIONS,
    BETA,
    BOTTLENECK,
    EPS,
    FEW,
    ISLAND,
    LIKENESS,
    PLACES,
    PRESETS,
    RELABELLED,
    ROBUST,
    SLIPS,
    TODAY,
    Arm,
    noisy,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#e69f00",
    "#56b4e9",
    "#000000",
    "#999999",
    "#6a3d9a",
    "#b15928",
    "#f0e442",
    "#117733",
)
MARKERS = "osD^v<>PX*hd"


def rates(figure: Figure, rows: Rows) -> None:
    """Deaths against the rate of slips: a panel for each level, a line for each preset."""
    figure.set_size_inches(9, 5.5)
    for axes, level in zip(figure.subplots(2, 3).flat, PLACES, strict=True):
        for preset, colour in zip(PRESETS, COLOURS, strict=False):
            eps = [
                one
                for one in (EPS if level in (ISLAND, BOTTLENECK) else FEW)
                if Arm(level, preset, noisy(one)).name in rows
            ]
            _line(
                axes,
                [100 * one for one in eps],
                [Arm(level, preset, noisy(one)) for one in eps],
                rows,
                colour,
                preset,
            )
        axes.set_title(level, fontsize=10)
        axes.set_xlabel("wrong answers, %")
        axes.set_ylabel("deaths")
    _legend(figure, axes)


def kinds(figure: Figure, rows: Rows) -> None:
    """Deaths on the island against beta, and against the rate of errors where clips are alike."""
    figure.set_size_inches(8, 3.8)
    left, right = figure.subplots(1, 2)
    for preset, colour in zip(PRESETS, COLOURS, strict=False):
        beta = [one for one in BETA if Arm(ISLAND, preset, f"boltzmann:{one:g}").name in rows]
        _line(left, beta, [Arm(ISLAND, preset, f"boltzmann:{one:g}") for one in beta], rows, colour, preset)
        eps = [one for one in LIKENESS if Arm(ISLAND, preset, f"likeness:{one:g}").name in rows]
        some = [Arm(ISLAND, preset, f"likeness:{one:g}") for one in eps]
        _line(right, [100 * one for one in eps], some, rows, colour, f"{preset}")
        even = [
            Arm(ISLAND, preset, noisy(one)) for one in eps if Arm(ISLAND, preset, noisy(one)).name in rows
        ]
        _line(right, [100 * one for one in eps][: len(even)], even, rows, colour, None, ":")
    left.set_xlabel("beta of a Boltzmann parent")
    right.set_xlabel("% wrong by likeness (dotted: anywhere)")
    for axes in (left, right):
        axes.set_ylabel("deaths")
    _legend(figure, left)


def frontier(figure: Figure, rows: Rows, until: bool = True) -> None:
    """Deaths against questions for every way to withstand slips: two levels, two rates of slips."""
    figure.set_size_inches(9, 7.5)
    for axes, (level, eps) in zip(
        figure.subplots(2, 2).flat,
        [(level, eps) for level in (ISLAND, BOTTLENECK) for eps in SLIPS],
        strict=True,
    ):
        for place, way in enumerate((TODAY, *ROBUST, *RELABELLED)):
            arm = Arm(level, way, noisy(eps))
            if arm.name in rows:
                _point(axes, rows, arm, UNTIL if until else QUESTIONS, place)
        axes.set_title(f"{level}, {100 * eps:.0f} % wrong", fontsize=10)
        axes.set_xlabel("questions until the policy is optimal" if until else "questions")
        axes.set_ylabel("deaths")
        axes.set_ylim(bottom=0)
        axes.set_xlim(left=0)
    _legend(figure, figure.axes[0], 4)


def misconceptions(figure: Figure, rows: Rows) -> None:
    """Deaths against questions with parents who give the same wrong answer each time."""
    axes = figure.subplots()
    for place, way in enumerate((TODAY, *ROBUST)):
        arm = Arm(ISLAND, way, "misconceived:0.1")
        if way in AGAINST_MISCONCEPTIONS and arm.name in rows:
            _point(axes, rows, arm, QUESTIONS, place)
    axes.set_xlabel("questions")
    axes.set_ylabel("deaths")
    axes.set_ylim(bottom=0)
    _legend(figure, axes)


def _line(
    axes: Axes,
    x: Sequence[float],
    arms: Sequence[Arm],
    rows: Rows,
    colour: str,
    label: str | None,
    style: str = "-",
) -> None:
    y, error = _means([values(rows[arm.name], DEATHS) for arm in arms])
    axes.errorbar(x, y, yerr=error, fmt=f"o{style}", color=colour, markersize=3, capsize=2, label=label)


def _point(axes: Axes, rows: Rows, arm: Arm, across: str, place: int) -> None:
    mine = rows[arm.name]
    (x,), across_error = _means([values(mine, across) or values(mine, QUESTIONS)])
    (y,), error = _means([values(mine, DEATHS)])
    axes.errorbar(
        x,
        y,
        xerr=across_error,
        yerr=error,
        fmt=MARKERS[place],
        color=COLOURS[place],
        markersize=6,
        capsize=2,
        linewidth=1,
        label=arm.way,
    )


def _means(groups: Sequence[Sequence[float]]) -> tuple[list[float], list[float]]:
    """Means, and half of each one's 95 % interval."""
    spans = [mean_interval(group) for group in groups]
    return [fmean(group) for group in groups], [(span.high - span.low) / 2 if span else 0.0 for span in spans]


def _legend(figure: Figure, axes: Axes, columns: int = 4) -> None:
    drawn, labels = axes.get_legend_handles_labels()
    figure.legend(drawn, labels, loc="outside lower center", ncols=columns, fontsize=8)

"""Calibration: which of the lost settings bring the legible numbers of Table 1 back? (Sec. 3.2.1)

A grid of layouts and settings is tried with a few trials each. The nearest setting of all
(`experiments/calibrate/distance.py`) is then confirmed with trials that this search has not seen, and lax and
conservative parenting are raised beside it. The grid was not chosen blindly: docs/paper.md, "Calibration".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from parenting.experiments.calibrate.distance import HYPERPARAMETERS
from parenting.experiments.calibrate.plot import scatter
from parenting.experiments.calibrate.report import findings
from parenting.experiments.calibrate.settings import (
    GRID,
    LAYOUTS,
    MAX_STEPS,
    MAX_TICKS,
    SEARCH_STEPS,
    SEARCH_TICKS,
    SOME,
    WORLD,
)
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, Scale, chunk_ranges
from parenting.experiments.table1.report import AGREEMENT, ALGORITHMS


def _grid(scale: Scale) -> Iterator[tuple[str, dict[str, Any]]]:
    """Layouts, and settings of direct policy learning."""
    grid = GRID[scale]
    for layout, chance, weights, twice in product(
        grid["layout"], grid["chance"], grid["entropy weights"], grid["recompare"]
    ):
        yield layout, dict(zip(HYPERPARAMETERS, (chance, chance, *weights, twice), strict=True))


def _config(request: Request) -> Mapping[str, Any]:
    return {
        "world": WORLD,
        "layouts": LAYOUTS,
        "grid": GRID,
        "trials of a setting": SOME,
        "limits": {"search": [SEARCH_TICKS, SEARCH_STEPS], "confirming": [MAX_TICKS, MAX_STEPS]},
    }


def _tasks(request: Request) -> list[Task]:
    tried = [*_direct_tasks(request), *_reward_tasks(request)]
    needs = tuple(task.key for task in tried)
    return [*tried, *(task._replace(needs=needs) for task in _confirming(request))]


def _direct_tasks(request: Request) -> Iterator[Task]:
    some = SOME[request.scale]
    for number, (layout, hyperparameters) in enumerate(_grid(request.scale)):
        mine = {"layout": layout, "hyperparameters": hyperparameters, "trials": some, "seed": request.seed}
        yield Task(
            f"{request.scale}-direct-{number:03d}",
            "parenting.experiments.calibrate.tasks:try_direct",
            mine,
            some,
        )


def _reward_tasks(request: Request) -> Iterator[Task]:
    some, grid = SOME[request.scale], GRID[request.scale]
    for number, (layout, entropy) in enumerate(product(grid["layout"], grid["entropy"])):
        mine = {"layout": layout, "entropy": entropy, "trials": some, "seed": request.seed}
        yield Task(
            f"{request.scale}-traditional-{number:03d}",
            "parenting.experiments.calibrate.tasks:try_reward",
            mine,
            some,
        )


def _confirming(request: Request) -> Iterator[Task]:
    for one, span in product(ALGORITHMS, chunk_ranges(request.trials)):
        mine = {
            "algorithm": one.name,
            "span": (span.start, span.stop),
            "seed": request.seed,
        }
        key = f"{request.scale}-confirm-{one.name}-{span.start:06d}-{span.stop:06d}"
        yield Task(key, "parenting.experiments.calibrate.tasks:confirm_trials", mine, len(span))


def _report(request: Request, rows: Sequence[Row]) -> Results:
    return Results(findings(rows), WORDS, {"search": lambda figure: scatter(figure, rows)})


WORDS = (
    "Lost in our copy are the layout, all probabilities and both entropy weights. Tried is every combination "
    "of a layout, one chance for recording and asking alike, a pair of entropy weights, and comparing twice "
    "or not (`recompare`); and, for policy gradients, of a layout and a weight of entropy of their own, of "
    "which the paper says nothing. Layouts lie between `island` and `island-bottleneck` by a rule: "
    "`bottleneck-w-a` has a strait of w cells between its two rooms, a columns beside the straight way.",
    "The distance of a setting is the sum over 47 +- 14, 51 and 2300 +- 700 of ((ours - the paper's) / the "
    "paper's deviation) squared; the deviation of the 51 is lost, and 14 stands in for it. A setting that "
    f"leaves more than an eighth of its trials unfinished within {SEARCH_TICKS} ticks, or {SEARCH_STEPS} "
    "steps of policy gradients, is out. The nearest one is raised again, by trials that this search has not "
    "seen: those are the rows by algorithm. Lax parenting has its own `p_guid`, and all else from direct "
    "policy learning; conservative parenting has its own chances (docs/paper.md, Lost numbers).",
    "So three numbers are *fitted*: that they agree says that there are such settings, on a layout of ours, "
    "and not that the paper had them. Traditional RL has a knob of its own, its weight of entropy, which "
    "nothing else depends on. Lax and conservative parenting are out of sample: nothing was chosen by what "
    "they came to. Nor was the grid chosen blindly: an earlier look had been there (docs/paper.md, "
    "Calibration, says what it saw).",
    *AGREEMENT,
    "In the figure each point is a setting: on the left one of direct policy learning, on the right one of "
    "policy gradients.",
)

EXPERIMENT = Experiment(
    name="calibrate",
    title="Calibration: the settings that bring Table 1 back",
    section="3.2.1",
    claim="Direct policy learning dies 47 +- 14 times with about 51 preference queries where traditional RL "
    "dies 2300 +- 700 times.",
    trials={"quick": 2, "paper": 100},
    config=_config,
    tasks=_tasks,
    report=_report,
)

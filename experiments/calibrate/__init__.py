"""Calibration: a search for settings that reproduce the legible numbers of Table 1 (Sec. 3.2.1).

It tries a grid of layouts and settings with a few trials each. The nearest setting (`distance.py`) is then
confirmed with trials that the search has not used, together with lax and conservative parenting. The grid was
not chosen blindly: docs/paper.md, "Calibration".
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
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, Scale, chunk_ranges
from parenting.experiments.table1.report import ALGORITHMS


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
    words = paragraphs("calibrate/page.md", search_ticks=SEARCH_TICKS, search_steps=SEARCH_STEPS)
    return Results(findings(rows), words, {"search": lambda figure: scatter(figure, rows)})


EXPERIMENT = Experiment(
    name="calibrate",
    title="Calibration: settings that reproduce Table 1",
    section="3.2.1",
    claim="Direct policy learning has 47 +- 14 deaths with about 51 preference queries, and traditional RL "
    "2300 +- 700 deaths.",
    trials={"quick": 2, "paper": 100},
    config=_config,
    tasks=_tasks,
    report=_report,
)

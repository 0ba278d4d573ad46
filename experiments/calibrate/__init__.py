"""Calibration: which of the lost settings bring the legible numbers of Table 1 back? (Sec. 3.2.1)

A grid of layouts and settings is tried with a few trials each. The nearest setting of all
(`experiments/calibrate/distance.py`) is then confirmed with trials that this search has not seen, and lax and
conservative parenting are raised beside it. The grid was not chosen blindly: docs/paper.md, "Calibration".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from parenting.agent.config import PRESETS
from parenting.envs.levels.unsafe_exploration import ISLAND, ISLAND_BOTTLENECK
from parenting.experiments.calibrate.distance import DIRECT, HYPERPARAMETERS, TRADITIONAL, search
from parenting.experiments.calibrate.layouts import bottleneck
from parenting.experiments.calibrate.plot import scatter
from parenting.experiments.calibrate.report import findings
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, Scale, chunk_ranges
from parenting.experiments.table1.report import AGREEMENT, ALGORITHMS
from parenting.experiments.training.tasks import parent_trials, reinforce_trials

WORLD = "unsafe-exploration"
LAYOUTS = {
    "island": ISLAND,
    "strait-2-1": bottleneck(2, 1),
    "strait-1-1": bottleneck(1, 1),
    "island-bottleneck": ISLAND_BOTTLENECK,
}
"""From easy to hard; `bottleneck` has the rule."""
SOME: Mapping[Scale, int] = {"quick": 2, "paper": 8}
"""Trials of each setting of the search."""
GRID: Mapping[Scale, Mapping[str, tuple[Any, ...]]] = {
    "quick": {
        "layout": ("strait-1-1",),
        "chance": (0.35,),
        "entropy weights": ((1.0, 0.1),),
        "recompare": (True,),
        "entropy": (1.2,),
    },
    "paper": {
        "layout": tuple(LAYOUTS),
        "chance": (0.25, 0.3, 0.35, 0.45),  # of recording and of asking
        "entropy weights": ((0.01, 0.01), (1.0, 0.1), (0.5, 0.5)),  # lambda_global, lambda_local
        "recompare": (False, True),
        "entropy": (0.1, 0.5, 0.8, 1.0, 1.2),  # of policy gradients
    },
}
SEARCH_TICKS, SEARCH_STEPS = 1_000, 500
"""Where the search gives a trial up: ticks of parenting, and steps of policy gradients."""
MAX_TICKS, MAX_STEPS = 4_000, 1_000
"""Where the confirming trials are given up."""
OTHER = 7_919
"""Added to the seed for the search, so that what confirms its finding is not what made it."""


def try_direct(layout: str, hyperparameters: Mapping[str, Any], trials: int, seed: int) -> list[Row]:
    """Direct policy learning with one setting."""
    text, span = LAYOUTS[layout], (0, trials)
    rows = parent_trials(
        DIRECT, WORLD, text, "direct", hyperparameters, ("optimal", 0), SEARCH_TICKS, span, seed + OTHER
    )
    return [{**row, "layout": layout, **hyperparameters} for row in rows]


def try_reward(layout: str, entropy: float, trials: int, seed: int) -> list[Row]:
    """Policy gradients with one weight of their entropy."""
    span = (0, trials)
    rows = reinforce_trials(
        TRADITIONAL, WORLD, LAYOUTS[layout], {}, SEARCH_STEPS, span, seed + OTHER, entropy
    )
    return [{**row, "layout": layout, "entropy": entropy} for row in rows]


def confirm_trials(algorithm: str, span: tuple[int, int], seed: int, given: Sequence[Row]) -> list[Row]:
    """Trials of one algorithm of Table 1 with what the search, whose rows are `given`, has found nearest."""
    best, *_ = search(given)
    text = LAYOUTS[best.layout]
    if algorithm == "traditional":
        return reinforce_trials(algorithm, WORLD, text, {}, MAX_STEPS, span, seed, best.entropy)
    hyperparameters = settings(algorithm, best.direct)
    return parent_trials(
        algorithm, WORLD, text, algorithm, hyperparameters, ("optimal", 0), MAX_TICKS, span, seed
    )


def settings(preset: str, direct: Mapping[str, Any]) -> dict[str, Any]:
    """What a preset takes over from direct policy learning: lax parenting all of it, and the conservative one
    keeps its own chances.
    """
    own = PRESETS[preset] if preset == "conservative" else {}
    return {name: value for name, value in direct.items() if name not in own}


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
            f"{request.scale}-direct-{number:03d}", "parenting.experiments.calibrate:try_direct", mine, some
        )


def _reward_tasks(request: Request) -> Iterator[Task]:
    some, grid = SOME[request.scale], GRID[request.scale]
    for number, (layout, entropy) in enumerate(product(grid["layout"], grid["entropy"])):
        mine = {"layout": layout, "entropy": entropy, "trials": some, "seed": request.seed}
        yield Task(
            f"{request.scale}-traditional-{number:03d}",
            "parenting.experiments.calibrate:try_reward",
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
        yield Task(key, "parenting.experiments.calibrate:confirm_trials", mine, len(span))


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

"""Parents who err: deaths and questions against their errors, and what withstands them (beyond the paper)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from parenting.agent.config import PRESETS
from parenting.experiments.fallible.plot import frontier, kinds, misconceptions, rates
from parenting.experiments.fallible.report import PROBED, Rows, by_arm, findings
from parenting.experiments.fallible.settings import (
    ARMS,
    FRESH_SEED,
    PLACES,
    TICKS,
    TRIALS,
    TRIPLE,
    WAYS,
    Arm,
    ticks,
    tried,
)
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, chunk_ranges

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOGETHER = 100
"""Trials of a task at most: more would be no faster (docs/benchmarks.md)."""


def _config(request: Request) -> Mapping[str, Any]:
    return {
        "ticks": TICKS,
        "frugal": PRESETS["frugal"],
        "variants": {
            name: [PLACES[arm.level].world, arm.level, WAYS[arm.way].preset, arm.changes, arm.parent]
            for name, arm in ARMS.items()
        },
    }


def _tasks(request: Request) -> list[Task]:
    return [
        _task(arm, span, request)
        for arm in tried(request.scale).values()
        for span in chunk_ranges(arm.trials(request.trials), min(arm.part, TOGETHER))
    ]


def _task(arm: Arm, span: range, request: Request) -> Task:
    way, last = WAYS[arm.way], ticks(request.scale)
    mine = {
        "label": arm.name,
        "world": PLACES[arm.level].world,
        "level": arm.level,
        "preset": way.preset,
        "changes": arm.changes,
        "parent": arm.parent,
        "thrice": way.thrice,
        "ticks": last,
        "span": (span.start, span.stop),
        "seed": request.seed,
    }
    if arm.fresh:
        mine |= {"seed": request.seed + FRESH_SEED, "until_optimal": True}
    name = arm.name.replace(",", "").replace(" ", "-").replace(":", "-")
    key = f"{name}-{last}-{span.start:06d}-{span.stop:06d}"
    return Task(key, "parenting.experiments.fallible.tasks:erring_trials", mine, arm.work * len(span))


def _report(request: Request, rows: Sequence[Row]) -> Results:
    found = by_arm(rows)
    words = paragraphs(
        "fallible/page.md",
        ticks=ticks(request.scale),
        seed=request.seed,
        fresh=request.seed + FRESH_SEED,
        fresh_trials=round(TRIALS * TRIPLE),
        probed=PROBED,
    )
    every: dict[str, Callable[[Figure, Rows], None]] = {
        "frontier": frontier,
        "all-questions": partial(frontier, until=False),
        "rates": rates,
        "kinds": kinds,
        "misconceptions": misconceptions,
    }
    if request.scale == "quick":
        return Results(findings(found), words)
    return Results(findings(found), words, {name: _drawn(draw, found) for name, draw in every.items()})


def _drawn(draw: Callable[[Figure, Rows], None], rows: Rows) -> Callable[[Figure], None]:
    return lambda figure: draw(figure, rows)


EXPERIMENT = Experiment(
    name="fallible",
    title="Parents who err",
    section="",
    claim="A parent errs: do deaths grow with the errors, and does asking again, to be sure, prevent them?",
    trials={"quick": 2, "paper": TRIALS},
    config=_config,
    tasks=_tasks,
    report=_report,
)

"""Table 1: deaths in Unsafe Exploration before the policy is optimal, by four algorithms (Sec. 3.2.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.experiments.reporting.plots import box_plots
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, chunk_ranges
from parenting.experiments.table1.report import (
    ALGORITHMS,
    Algorithm,
    cells,
    finished,
    optimal_initially,
    order,
    paper_range,
)

WORLD, LEVEL = "unsafe-exploration", "island"
TOGETHER = 100
"""Trials of a task at most: more would be no faster (docs/benchmarks.md)."""
MAX_TICKS, MAX_STEPS = 20_000, 3_000


def _config(request: Request) -> Mapping[str, Any]:
    return {"world": WORLD, "level": LEVEL, "max_ticks": MAX_TICKS, "max_steps": MAX_STEPS}


def _tasks(request: Request) -> list[Task]:
    return [
        _task(one, span, request) for one in ALGORITHMS for span in chunk_ranges(request.trials, TOGETHER)
    ]


def _task(one: Algorithm, span: range, request: Request) -> Task:
    key = f"{one.name}-{span.start:06d}-{span.stop:06d}"
    mine: dict[str, Any] = {
        "label": one.name,
        "world": WORLD,
        "level": LEVEL,
        "changes": {},
        "span": (span.start, span.stop),
        "seed": request.seed,
    }
    cost = one.cost * len(span)
    if one.preset is None:
        return Task(
            key,
            "parenting.experiments.training.tasks:reinforce_trials",
            {**mine, "max_steps": MAX_STEPS},
            cost,
        )
    more = {"preset": one.preset, "until": ("optimal", 0), "max_ticks": MAX_TICKS}
    return Task(key, "parenting.experiments.training.tasks:parent_trials", {**mine, **more}, cost)


def _report(request: Request, rows: Sequence[Row]) -> Results:
    findings = [
        *(finding for one in ALGORITHMS for finding in cells(one, rows)),
        *order(rows),
        optimal_initially(rows),
    ]
    deaths = {one.title: finished(one, rows, "deaths") for one in ALGORITHMS}
    paper = {one.title: span for one in ALGORITHMS if (span := paper_range(one.deaths))}
    label = "deaths before the optimal policy"
    words = paragraphs("table1/page.md", level=LEVEL, max_ticks=MAX_TICKS, max_steps=MAX_STEPS)
    return Results(findings, words, {"deaths": lambda figure: box_plots(figure, deaths, label, paper)})


EXPERIMENT = Experiment(
    name="table1",
    title="Table 1: deaths before the optimal policy",
    section="3.2.1",
    claim="Parenting prevents deaths during exploration; the more the agent asks, the fewer its deaths.",
    trials={"quick": 50, "paper": 1000},
    config=_config,
    tasks=_tasks,
    report=_report,
)

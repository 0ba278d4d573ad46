"""Figure 4: preferences determine a reward only up to a shift, and a shift can be unsafe (Sec. 4.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.experiments.figure4.plot import _draw
from parenting.experiments.figure4.report import _at, _loss, _planner, _sum
from parenting.experiments.figure4.settings import HORIZON, LENGTH, LEVEL, PAIRS, WORLD
from parenting.experiments.reporting.comparison import SILENT
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results


def _config(request: Request) -> Mapping[str, Any]:
    return {"world": WORLD, "level": LEVEL, "horizon": HORIZON, "length": LENGTH, "pairs": PAIRS}


def _tasks(request: Request) -> list[Task]:
    call = "parenting.experiments.figure4.tasks:fit_and_shift"
    return [
        Task(f"fit-{trial:06d}", call, {"trial": trial, "seed": request.seed})
        for trial in range(request.trials)
    ]


def _report(request: Request, rows: Sequence[Row]) -> Results:
    first = {(row["of"], row["shift"]): row for row in rows if row["trial"] == 0}
    findings = [
        _sum("rho, unsafe path (drrdd)", "0", first["rho", 0.0]["unsafe"]),
        _sum("rho, safe path (ldrdrrd)", "1", first["rho", 0.0]["safe"]),
        _sum("sigma = rho - 1, unsafe path", "-5", first["rho", -1.0]["unsafe"]),
        _sum("sigma = rho - 1, safe path", "-6", first["rho", -1.0]["safe"]),
        _planner("planner on rho", "safe", [first["rho", 0.0]]),
        _planner("planner on sigma", "unsafe", [first["rho", -1.0]]),
        _planner("planner on the fitted reward, at the shift of rho", "safe", _at(rows, "fitted", 0.0)),
        _planner("planner on the fitted reward, shifted by -1", "unsafe", _at(rows, "fitted", -1.0)),
        _planner("planner on rho - 1/2, where both paths have the same return", SILENT, [first["rho", -0.5]]),
        _planner("planner on the fitted reward, shifted by -1/2", SILENT, _at(rows, "fitted", -0.5)),
        _loss(rows),
    ]
    words = paragraphs("figure4/page.md", pairs=PAIRS, length=LENGTH, horizon=HORIZON)
    return Results(findings, words, {"shift": lambda figure: _draw(figure, rows)})


EXPERIMENT = Experiment(
    name="figure4",
    title="Figure 4: an unsafe shift of the reward",
    section="4.2",
    claim="Preferences determine a reward only up to a shift, and a shift can make "
    "the irreversible path optimal.",
    trials={"quick": 1, "paper": 10},
    config=_config,
    tasks=_tasks,
    report=_report,
)

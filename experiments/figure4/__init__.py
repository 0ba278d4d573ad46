"""Figure 4: a reward that is fitted to preferences is fixed up to a shift, and a shift can do harm (4.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.experiments.figure4.plot import _draw
from parenting.experiments.figure4.report import _at, _loss, _planner, _sum
from parenting.experiments.figure4.settings import HORIZON, LENGTH, LEVEL, PAIRS, WORLD
from parenting.experiments.reporting.comparison import SILENT
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
        _planner("planner on sigma", "harm", [first["rho", -1.0]]),
        _planner("planner on the fitted reward, where rho is", "safe", _at(rows, "fitted", 0.0)),
        _planner("planner on the fitted reward, shifted by -1", "harm", _at(rows, "fitted", -1.0)),
        _planner("planner on rho - 1/2, where both paths earn the same", SILENT, [first["rho", -0.5]]),
        _planner("planner on the fitted reward, shifted by -1/2", SILENT, _at(rows, "fitted", -0.5)),
        _loss(rows),
    ]
    return Results(findings, WORDS, {"shift": lambda figure: _draw(figure, rows)})


WORDS = (
    "The reward model has a number for each state and action of the level. It is fitted to what a person "
    f"who follows rho prefers, on {PAIRS} pairs of random clips of {LENGTH} steps: to the very chances "
    "that Bradley and Terry's rule gives, not to answers drawn by them, so that no noise of a sample is "
    "in it.",
    "All shifts of the fit explain the answers equally well (Eq. 12). A fit has no shift of its own, so "
    "it is first put where rho is: its mean difference from rho, over all states in which an episode goes "
    "on, is made 0. That takes rho itself; nobody who has preferences alone can do it.",
    "Below a shift of -1/2 the planner pushes the box into the corner. At -1/2 both paths earn the same "
    "by rho; there the order of the actions decides, and with a fitted reward what the fit is off by, "
    "which is less than a thousandth.",
    f"The planner looks {HORIZON} steps ahead. Where the shift is 0 it does not mind the time, and where "
    "it is above it likes to take longer. So it arrives safely there, but not by the paper's seven steps: "
    "it dithers on the way, and arrives with the last steps that it has. Between -1/2 and 0 it takes "
    "seven.",
    "In the figure each line is a fit of its own; they lie on each other.",
    "A parented agent plans on no reward; `tests/parents/test_shift.py` shows that its policy is the same "
    "under both, bit for bit.",
)

EXPERIMENT = Experiment(
    name="figure4",
    title="Figure 4: a shift of the reward does harm",
    section="4.2",
    claim="Preferences fix a reward up to a shift, and a shift can make the irreversible way optimal.",
    trials={"quick": 1, "paper": 10},
    config=_config,
    tasks=_tasks,
    report=_report,
)

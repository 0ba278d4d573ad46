"""Several parents: learning how far each is to be trusted, against counting votes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.experiments.panel.plot import draw
from parenting.experiments.panel.report import best, findings
from parenting.experiments.panel.settings import LEVEL, PANELS, PRESET, RULES, TICKS, WORLD, Members
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, chunk_ranges


def _config(request: Request) -> Mapping[str, Any]:
    return {
        "world": WORLD,
        "level": LEVEL,
        "preset": PRESET,
        "ticks": TICKS,
        "panels": {panel.name: list(panel.rates) for panel in PANELS},
        "rules": list(RULES),
    }


def _tasks(request: Request) -> list[Task]:
    return [
        _task(panel, rule, span, request)
        for span in chunk_ranges(request.trials)
        for panel in PANELS
        for rule in RULES
    ]


def _task(panel: Members, rule: str, span: range, request: Request) -> Task:
    arm = f"{panel.name} {rule}".replace(",", "").replace(" ", "-")
    arguments = {
        "name": panel.name,
        "rates": list(panel.rates),
        "rule": rule,
        "span": [span.start, span.stop],
        "seed": request.seed,
    }
    call = "parenting.experiments.panel.tasks:panel_trials"
    return Task(f"{arm}-{span.start:06d}-{span.stop:06d}", call, arguments, float(len(span)))


def _report(request: Request, rows: Sequence[Row]) -> Results:
    rates = {panel.name: ", ".join(f"{100 * rate:g} %" for rate in panel.rates) for panel in PANELS}
    found = {panel.name: best(rows, panel.name) for panel in PANELS}
    words = paragraphs("panel/page.md", level=LEVEL, preset=PRESET, ticks=TICKS, panels=rates, best=found)
    return Results(findings(rows), words, {"rules": lambda figure: draw(figure, rows)})


EXPERIMENT = Experiment(
    name="panel",
    title="Several parents: one trust each, learnt",
    section="",
    claim="Several parents answer each question; a trust learnt for each of them beats counting their votes.",
    trials={"quick": 2, "paper": 100},
    config=_config,
    tasks=_tasks,
    report=_report,
)

"""Long lives: whether answers and deaths of the preset frugal fall towards zero with ticks (ours).

The page on questions watches its long lives for a thousand ticks, in windows of a hundred. Here windows are
ten times as long, so that their bounds on deaths are narrow enough to tell, and lives go on for longer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.agent.config import PRESETS
from parenting.experiments.long_lives.settings import (
    FEW,
    LEVEL,
    PRESET,
    STAGE_TICKS,
    STAGES,
    TICKS,
    TOGETHER,
    WINDOW,
    WORLD,
    agents_of,
)
from parenting.experiments.questions.plot import draw_windows
from parenting.experiments.questions.verdicts import falling
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, chunk_ranges


def _config(request: Request) -> Mapping[str, Any]:
    return {"world": WORLD, "level": LEVEL, PRESET: PRESETS[PRESET]}


def _tasks(request: Request) -> list[Task]:
    return [
        _task(name, last, span, request)
        for name, last in STAGES.items()
        for span in chunk_ranges(agents_of(last, request.trials), TOGETHER)
    ]


def _task(name: str, last: int, span: range, request: Request) -> Task:
    ticks, window = TICKS[request.scale], WINDOW[request.scale]
    mine = {
        "label": name,
        "life": (WORLD, LEVEL, PRESET, {"max_clip_length": last}, "scripted"),
        "ticks": ticks,
        "stage_ticks": STAGE_TICKS[request.scale],
        "span": (span.start, span.stop),
        "seed": request.seed,
        "window": window,
    }
    key = f"{PRESET}-{last}-{ticks}-{window}-{span.start:06d}-{span.stop:06d}"
    call = "parenting.experiments.questions.tasks:long_trials"
    return Task(key, call, mine, float(last * len(span)))


def _report(request: Request, rows: Sequence[Row]) -> Results:
    ticks, window = TICKS[request.scale], WINDOW[request.scale]
    words = paragraphs(
        "long_lives/page.md",
        agents=", ".join(f"{agents_of(last, request.trials)} at T = {last}" for last in STAGES.values()),
        few=FEW,
        together=TOGETHER,
        ticks=ticks,
        window=window,
        stage_ticks=STAGE_TICKS[request.scale],
        level=LEVEL,
    )
    found = [row for name in STAGES for row in falling(name, rows)]
    return Results(
        found, words, {"windows": lambda figure: draw_windows(figure, rows, tuple(STAGES), window)}
    )


EXPERIMENT = Experiment(
    name="long-lives",
    title="Long lives: questions and deaths in thousands of ticks",
    section="",
    claim="Do both the rate of questions and that of deaths fall towards zero as an agent lives on?",
    trials={"quick": 2, "paper": 100},
    config=_config,
    tasks=_tasks,
    report=_report,
)

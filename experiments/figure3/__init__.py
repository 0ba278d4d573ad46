"""Figure 3: generalisation to other levels, by the queries until ten are solved (Sec. 3.4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.experiments.figure3.levels import HEIGHT, PRESET, WIDTH, WORLD
from parenting.experiments.figure3.plot import draw
from parenting.experiments.figure3.report import findings
from parenting.experiments.figure3.settings import SIZES, Curve, Size, curves, whole
from parenting.experiments.figure3.tasks import BATCH
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, chunk_ranges

CALLS = "parenting.experiments.figure3.tasks:"


def _config(request: Request) -> Mapping[str, Any]:
    return {
        "world": WORLD,
        "height": HEIGHT,
        "width": WIDTH,
        "preset": PRESET,
        "sizes": {scale: size._asdict() for scale, size in SIZES.items()},
    }


def _tasks(request: Request) -> list[Task]:
    size = SIZES[request.scale]
    split = {"parenting": size.parenting, "aside": size.aside, "seed": request.seed}
    found = [Task(_levels(request), "parenting.experiments.figure3.levels:find_levels", split)]
    for recompare in (False, True):
        for worlds in (size.some, size.many):
            found += [_pre_parent(worlds, recompare, span, request) for span in _agents(size)]
    every = [(one, recompare) for recompare in (False, True) for one in curves(request.scale)]
    for one, recompare in [*every, (whole(request.scale), False)]:
        found += [_parent(one, recompare, span, request) for span in chunk_ranges(request.trials)]
    return found


def _agents(size: Size) -> list[range]:
    return chunk_ranges(size.agents, BATCH)


def _levels(request: Request) -> str:
    return f"{request.scale}-levels"


def _key(request: Request, recompare: bool, name: str, span: range) -> str:
    return f"{request.scale}-{'twice' if recompare else 'once'}-{name}-{span.start:06d}-{span.stop:06d}"


def _pre_parent(worlds: int, recompare: bool, span: range, request: Request) -> Task:
    size = SIZES[request.scale]
    mine = {
        "worlds": worlds,
        "recompare": recompare,
        "everything": worlds == size.some and not recompare,
        "span": (span.start, span.stop),
        "max_ticks": size.pre_ticks,
        "seed": request.seed,
    }
    cost = worlds * len(span) * (3 if recompare else 1)
    key = _key(request, recompare, f"taught-{worlds}", span)
    return Task(key, f"{CALLS}pre_parent", mine, cost, needs=(_levels(request),))


def _parent(one: Curve, recompare: bool, span: range, request: Request) -> Task:
    size = SIZES[request.scale]
    mine = {
        "curve": one.name,
        "pretrain": one.pretrain,
        "everything": one.everything,
        "recompare": recompare,
        "span": (span.start, span.stop),
        "max_ticks": size.max_ticks,
        "seed": request.seed,
    }
    needs = [_levels(request)]
    if one.worlds:
        needs += [_key(request, recompare, f"taught-{one.worlds}", agents) for agents in _agents(size)]
    cost = one.cost * len(span) * (2 if recompare else 1)
    key = _key(request, recompare, one.key, span)
    return Task(key, f"{CALLS}parent_trials", mine, cost, needs=tuple(needs))


def _report(request: Request, rows: Sequence[Row]) -> Results:
    last = whole(request.scale)
    before = {one.name: one.worlds for one in (*curves(request.scale), last)}
    found = findings(before, last.name, rows, request.device)
    words = paragraphs("figure3/page.md", cells=HEIGHT, max_ticks=SIZES[request.scale].max_ticks)
    return Results(found, words, {"queries": lambda figure: draw(figure, list(before), rows)})


EXPERIMENT = Experiment(
    name="figure3",
    title="Figure 3: generalisation to other levels",
    section="3.4",
    claim="The more an agent has learnt before, from mazes and in other levels, the fewer queries it needs.",
    trials={"quick": 4, "paper": 100},
    config=_config,
    tasks=_tasks,
    report=_report,
)

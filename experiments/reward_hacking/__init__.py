"""Reward hacking: policies that exploit the bucket, which makes the garden look watered (Sec. 3.2.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.experiments.reporting.comparison import Comparison
from parenting.experiments.reporting.plots import Proportion, plot_proportions
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.reward_hacking.report import EPISODES, STEPS, counts, means, proportions
from parenting.experiments.reward_hacking.settings import MAX_TICKS, VARIANTS, Variant
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, chunk_ranges
from parenting.experiments.training.gardens import WORLD


def _config(request: Request) -> Mapping[str, Any]:
    variants = {
        name: [of.preset, of.level, dict(of.changes), list(of.milestones), of.one_of]
        for name, of in VARIANTS.items()
    }
    return {
        "world": WORLD,
        "max_ticks": MAX_TICKS,
        "steps": list(STEPS),
        "episodes": EPISODES,
        "variants": variants,
    }


def _tasks(request: Request) -> list[Task]:
    return [
        _task(name, span, request)
        for name, of in VARIANTS.items()
        for span in chunk_ranges(-(-request.trials // of.one_of))
    ]


def _milestones(of: Variant, request: Request) -> tuple[int, ...]:
    """The quick scale stops at the first."""
    return of.milestones if request.scale == "paper" else of.milestones[:1]


def _task(name: str, span: range, request: Request) -> Task:
    milestones = _milestones(VARIANTS[name], request)
    key = f"{milestones[-1]}-{name.replace(', ', '-').replace(' ', '-')}-{span.start:06d}-{span.stop:06d}"
    mine = {
        "variant": name,
        "milestones": milestones,
        "span": (span.start, span.stop),
        "seed": request.seed,
    }
    return Task(
        key,
        "parenting.experiments.reward_hacking.tasks:snapshot_trials",
        mine,
        VARIANTS[name].cost * len(span),
    )


def _report(request: Request, rows: Sequence[Row]) -> Results:
    findings, shown = list[Comparison](), list[Proportion]()
    for name, of in VARIANTS.items():
        milestones = _milestones(of, request)
        for queries in milestones:
            mine = [row for row in rows if (row["of"], row["queries"]) == (name, queries)]
            findings += counts(f"{_shown(name)}, after {queries} queries", mine)
        last = [row for row in mine if row["there"]]
        findings += means(what := f"{_shown(name)}, after {milestones[-1]} queries", of.level, last)
        shown += proportions(what, last)
    words = paragraphs("reward_hacking/page.md", episodes=EPISODES, steps=STEPS[-1])
    return Results(findings, words, {"shares": lambda figure: plot_proportions(figure, shown)})


def _shown(name: str) -> str:
    """The name of a variant on the page."""
    return name.replace("comparing twice", "repeated queries")


EXPERIMENT = Experiment(
    name="reward-hacking",
    title="Reward hacking: the bucket",
    section="3.2.2",
    claim="The parent never prefers a clip that enters the bucket, so no argmax policy exploits it.",
    trials={"quick": 4, "paper": 100},
    config=_config,
    tasks=_tasks,
    report=_report,
)

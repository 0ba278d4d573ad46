"""Table 1: deaths in Unsafe Exploration before the policy is optimal, by four algorithms (Sec. 3.2.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from experiments.drawings import spreads
from experiments.experiment import Asked, Experiment, Report, spans
from experiments.findings import LOST, Finding, between, spread
from experiments.pieces import Row, Task

WORLD, LEVEL = "unsafe-exploration", "island"
TOGETHER = 100
"""Trials of a task at most: more would be no faster (docs/benchmarks.md)."""
MAX_TICKS, MAX_STEPS = 20_000, 3_000


class Algorithm(NamedTuple):
    """A row of the table."""

    name: str
    title: str
    preset: str | None  # None: policy gradients
    share: float  # how much work a trial is, against the others
    deaths: str  # the paper's cells, as it prints them
    guidance: str
    preference: str


ALGORITHMS = (
    Algorithm("traditional", "Traditional RL", None, 0.4, "2300 +- 700", "-", "-"),
    Algorithm("direct", "Direct policy learning", "direct", 1.0, "47 +- 14", "-", f"51 +- ({LOST})"),
    Algorithm("lax", "Lax parenting", "lax", 1.0, LOST, LOST, LOST),
    Algorithm("conservative", "Conservative parenting", "conservative", 1.0, "0 or 1", LOST, LOST),
)


def _config(asked: Asked) -> Mapping[str, Any]:
    return {"world": WORLD, "level": LEVEL, "max_ticks": MAX_TICKS, "max_steps": MAX_STEPS}


def _tasks(asked: Asked) -> list[Task]:
    return [_task(one, span, asked) for one in ALGORITHMS for span in spans(asked.trials, TOGETHER)]


def _task(one: Algorithm, span: range, asked: Asked) -> Task:
    key = f"{one.name}-{span.start:06d}-{span.stop:06d}"
    mine: dict[str, Any] = {
        "label": one.name,
        "world": WORLD,
        "level": LEVEL,
        "changes": {},
        "span": (span.start, span.stop),
        "trials": asked.trials,
        "seed": asked.seed,
    }
    share = one.share * len(span)
    if one.preset is None:
        return Task(key, "experiments.raising:reward_some", {**mine, "max_steps": MAX_STEPS}, share)
    more = {"preset": one.preset, "until": ("optimal", 0), "max_ticks": MAX_TICKS}
    return Task(key, "experiments.raising:parent_some", {**mine, **more}, share)


def _report(asked: Asked, rows: Sequence[Row]) -> Report:
    findings = [finding for one in ALGORITHMS for finding in cells(one, rows)]
    deaths = {
        one.title: [row["deaths"] for row in rows if row["of"] == one.name and row["finished"]]
        for one in ALGORITHMS
    }
    label = "deaths before the optimal policy"
    return Report(findings, WORDS, {"deaths": lambda figure: spreads(figure, deaths, label)})


def cells(one: Algorithm, rows: Sequence[Row]) -> list[Finding]:
    """A row of the table: the cells that the paper has, and ours of the rows of that algorithm."""
    mine = [row for row in rows if row["of"] == one.name]
    done = [row for row in mine if row["finished"]]
    left = len(mine) - len(done)
    note = f"{left} of {len(mine)} trials unfinished, not in the mean" if left else ""
    columns = (("deaths", one.deaths), ("guidance", one.guidance), ("preference", one.preference))
    return [
        _cell(one, name, paper, [row[name] for row in done], note) for name, paper in columns if paper != "-"
    ]


def _cell(one: Algorithm, name: str, paper: str, values: Sequence[float], note: str) -> Finding:
    number = paper.split(" ")[0]
    legible = float(number) if number.isdigit() and " or " not in paper else None
    mean = sum(values) / len(values) if values else None
    return Finding(
        what=f"{one.title}: {name}",
        paper=paper,
        ours=spread(values),
        difference="" if legible is None or mean is None else f"{mean - legible:+.1f}",
        interval=between(values),
        agrees=_agrees(paper, legible, mean),
        note=note,
    )


def _agrees(paper: str, legible: float | None, mean: float | None) -> bool | None:
    """Within the paper's own deviation over trials, where one is legible; "0 or 1" is a mean of at most 1."""
    if mean is None or paper == LOST:
        return None
    if paper == "0 or 1":
        return mean <= 1
    deviation = paper.partition("+- ")[2]
    return abs(mean - (legible or 0.0)) <= float(deviation) if deviation.isdigit() else None


WORDS = (
    "The probabilities and the layout behind the paper's table are not legible in our copy. These are the "
    'settings of docs/paper.md, "Lost numbers", on the level `island`; so only the order of the four '
    "algorithms can be compared. `parenting experiment calibrate` searches for settings that bring the "
    "paper's numbers back.",
    "In the figure a box holds the middle half of the trials, whiskers nine tenths, and a point is the mean.",
)

EXPERIMENT = Experiment(
    name="table1",
    title="Table 1: deaths before the optimal policy",
    section="3.2.1",
    claim="Parenting keeps an agent that explores from dying; the more it asks, the better.",
    trials={"quick": 50, "paper": 1000},
    config=_config,
    tasks=_tasks,
    report=_report,
)

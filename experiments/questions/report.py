"""The rows of the page on questions: the verdicts, then answers and deaths of every arm."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from parenting.agent.config import FRUGAL_WORLDS
from parenting.envs.registry import WORLDS
from parenting.evaluation.statistics import count_interval
from parenting.experiments.questions.choice import choices
from parenting.experiments.questions.gardeners import gardeners, gardens
from parenting.experiments.questions.measures import (
    answers,
    deaths,
    independent,
    interval,
    left_out,
    raised,
    shown,
)
from parenting.experiments.questions.settings import (
    ANSWERS,
    ARMS,
    BASELINES,
    CHOICE_TRIALS,
    CHOICES,
    DEATHS_GOAL,
    GARDEN_TICKS,
    IDEAL,
    ISLAND,
    LASTING,
    LEVELS,
    LONG,
    MAX_TICKS,
    PRESETS,
    RANDOM,
    SILENT_TICKS,
    STAGE_TICKS,
    STARTS,
    WINDOW,
)
from parenting.experiments.questions.verdicts import GOALS, verdicts
from parenting.experiments.reporting.comparison import (
    Comparison,
    compare_mean,
    format_interval,
    mean_sd,
)
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row


def findings(rows: Sequence[Row]) -> list[Comparison]:
    """Verdicts first, then every number."""
    return [*verdicts(rows), *choices(rows), *gardens(rows), *_numbers(rows)]


def _numbers(rows: Sequence[Row]) -> Iterator[Comparison]:
    for world, level in LEVELS:
        yield from _bounds(world, level, rows)
    for name in (*ARMS, *CHOICES):
        mine = raised(name, rows)
        if not mine:
            continue
        yield Comparison(
            f"{name}: answers until optimal",
            "-",
            mean_sd(answers(mine)),
            interval=format_interval(count_interval(independent(name, mine, answers))),
            note=left_out(mine),
            reference=None,
        )
        died = interval(independent(name, mine, deaths) if any(deaths(mine)) else deaths(mine))
        yield Comparison(f"{name}: deaths", "-", mean_sd(deaths(mine)), interval=shown(died), reference=None)
        if name.split(", ")[0] in (*PRESETS, *BASELINES) and name.count(", ") == 1:
            for what in ("deaths", "regret"):
                area = _column(mine, f"area_{what}")
                yield compare_mean(f"{name}: area under {what}, up to {ANSWERS} answers", area)
    yield from gardeners(rows)
    yield from _starts(rows)


def _column(rows: Sequence[Row], column: str) -> list[float]:
    return [row[column] for row in rows]


def _bounds(world: str, level: str, rows: Sequence[Row]) -> Iterator[Comparison]:
    mine = raised(f"{IDEAL}, {level}", rows)
    if not mine:
        return
    least, certain = mine[0]["least_mean"], mine[0]["certain"]
    yield Comparison(f"{level}: mean answers, at least, by information", "-", f"{least:.2f}", reference=None)
    yield Comparison(f"{level}: answers to be certain, at least", "-", f"{certain}", reference=None)
    yield compare_mean(f"{level}: answers of the {IDEAL}", answers(mine), left_out(mine))


def _starts(rows: Sequence[Row]) -> Iterator[Comparison]:
    """The answers that the agents of random islands had before."""
    for level in GOALS:
        mine = [row for row in rows if row["of"] == f"pre-parented, {level}"]
        if mine:
            yield compare_mean(f"pre-parenting for {level}: answers of each agent", _column(mine, "guidance"))


def words(rows: Sequence[Row]) -> list[str]:
    """The prose of the page."""
    return paragraphs(
        "questions/page.md",
        last=ANSWERS - 1,
        random=RANDOM,
        choice_trials=CHOICE_TRIALS,
        garden_ticks=GARDEN_TICKS,
        random_start=STARTS[ISLAND].number,
        goal=DEATHS_GOAL,
        offered=" and ".join(WORLDS[world].title for world in FRUGAL_WORLDS),
        max_ticks=MAX_TICKS,
        silent_ticks=SILENT_TICKS,
        stage_ticks=STAGE_TICKS["paper"],
        window=WINDOW,
        long=LONG["paper"],
        lasting=LASTING["paper"],
    )

"""Figure 2's report: its baselines, its arms, prose and figure (Sec. 3.3)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import hypot
from statistics import fmean

from parenting.agent.config import FIELDS
from parenting.agent.pretraining_mazes import EPISODES as BATCH
from parenting.evaluation.rollouts import EPISODES
from parenting.evaluation.statistics import episode_interval
from parenting.experiments.figure2.agents import NEAR, compare_arms, queries_needed
from parenting.experiments.figure2.full_coverage import EPSILON
from parenting.experiments.figure2.plot import draw
from parenting.experiments.figure2.rows import (
    COVERAGE,
    MAIN,
    MANY,
    baseline,
    gradients,
    interval,
    of,
    setting,
    shown,
    waterings,
)
from parenting.experiments.figure2.settings import Arm, Baselines
from parenting.experiments.reporting.comparison import SILENT, Comparison, format_interval, mean_sd
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row
from parenting.experiments.spec import Results
from parenting.experiments.training.gardens import EPISODE, GAMMA

FIRST = {
    "garden": (4.49, 5.16, 5.24, 5.35, 5.38, 5.35),
    "garden-mirrored": (4.26, 4.74, 4.66, 4.78, 5.32, 5.43),
}
"""Look-ahead waterings of an earlier program of ours, T = 1 to 6, with the up-down parent."""
FIRST_ERRORS = (0.05, 0.05, 0.05, 0.05, 0.1, 0.1)
PARENT = 2
"""The paper's waterings of the parent's own policy, to the nearest whole number."""
ABOVE = 5.0
"""Waterings that the paper's policy gradients exceed."""


def report(rows: Sequence[Row], arms: Mapping[str, Arm], against: Baselines) -> Results:
    """The report on the rows of one scale, with the settings of its arms and baselines."""
    found = [
        *_parents(rows),
        *_gradients(rows),
        *compare_arms(rows),
        *_look_aheads(rows),
        *_full_coverage(rows),
        *queries_needed(rows),
    ]
    return Results(found, _prose(arms, against), {"maturation": lambda figure: draw(figure, rows)})


def _prose(arms: Mapping[str, Arm], against: Baselines) -> list[str]:
    return paragraphs(
        "figure2/page.md",
        fields=FIELDS,
        arms={shown(name): arm for name, arm in arms.items()},
        main=arms[MAIN],
        many=arms.get(MANY),
        against=against,
        episodes=EPISODES,
        steps=EPISODE,
        gamma=GAMMA,
        batch=BATCH,
        random=EPSILON,
    )


def _parents(rows: Sequence[Row]) -> Iterator[Comparison]:
    """The parent's own policy, an exact number; it agrees if it rounds to the paper's."""
    for row in of(rows, "parent"):
        ours = row["waterings"]
        yield Comparison(
            f"{setting(row)}: the parent's own policy",
            f"about {PARENT}",
            f"{ours:.2f}",
            difference=f"{ours - PARENT:+.2f}",
            agrees=round(ours) == PARENT,
            note="exact",
        )


def _gradients(rows: Sequence[Row]) -> Iterator[Comparison]:
    """Policy gradients after their last gradient step; the note shows whether they still improve."""
    for level in dict.fromkeys(row["level"] for row in of(rows, "policy gradients")):
        last = gradients(rows, level)
        before, steps = sorted({row["steps"] for row in of(rows, "policy gradients")})[-2:]
        earlier = [
            row["waterings"]
            for row in of(rows, "policy gradients")
            if (row["level"], row["steps"]) == (level, before)
        ]
        found = interval(last)
        yield Comparison(
            f"{level}: policy gradients without a bucket",
            f"above {ABOVE:.0f}",
            mean_sd(waterings(last)),
            interval=format_interval(found),
            agrees=found.above(ABOVE) if found else None,
            note=f"best {max(waterings(last)):.2f}; "
            f"{fmean(earlier):.2f} at {before} of {steps} gradient steps",
        )


def _look_aheads(rows: Sequence[Row]) -> Iterator[Comparison]:
    """The exact look-ahead, compared with our earlier program, which has only the up-down parent."""
    for row in of(rows, "look-ahead"):
        stage = row["stage"]
        first = FIRST[row["level"]][stage - 1] if row["inside"] == "up-down" else None
        yield Comparison(
            f"{setting(row)}: exact look-ahead, T = {stage}",
            SILENT if first is None else f"{first} (earlier program)",
            f"{row['waterings']:.2f}",
            difference="" if first is None else f"{row['waterings'] - first:+.2f}",
            interval=_shown_interval(row),
            agrees=None if first is None else _same(row, first, FIRST_ERRORS[stage - 1]),
            note=f"steps into the bucket: {row['bucket']}" if row["bucket"] else "",
            reference=None if first is None else "check",
        )


def _shown_interval(row: Row) -> str:
    """The interval of one policy over its episodes, as it is shown."""
    return format_interval(episode_interval(row["waterings"], row["error"]))


def _same(row: Row, first: float, error: float) -> bool:
    """Within three standard errors of the difference."""
    return bool(abs(row["waterings"] - first) <= 3 * hypot(row["error"], error))


def _full_coverage(rows: Sequence[Row]) -> Iterator[Comparison]:
    """The full-coverage agent, compared with the look-ahead on its training episodes and on new ones."""
    for row in of(rows, COVERAGE):
        exact = baseline(rows, "look-ahead", row)
        new = "" if exact is None else f", {100 * row['fresh'] / exact:.0f} % of the look-ahead's {exact:.2f}"
        yield Comparison(
            f"{setting(row)}: {shown(COVERAGE)}, T = {row['stage']}",
            f"within {100 * (1 - NEAR):.0f} % of {row['ahead']:.2f} (look-ahead)",
            f"{row['waterings']:.2f}",
            difference=f"{100 * (row['waterings'] / row['ahead'] - 1):+.1f} %",
            interval=_shown_interval(row),
            agrees=episode_interval(row["waterings"], row["error"]).above(NEAR * row["ahead"]),
            note=f"X covers {row['known']} of the {row['reached']} states that the policy visits, "
            f"after {row['questions']} questions in {row['states']} states; "
            f"{row['fresh']:.2f} on new episodes{new}; {row['bucket']} steps into the bucket",
            reference="check",
        )

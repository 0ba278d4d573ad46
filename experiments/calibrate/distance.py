"""The distance of a setting from the legible numbers of Table 1, and the nearest setting (Sec. 3.2.1).

The paper has three numbers of it: direct policy learning dies 47 +- 14 times with about 51 preference
queries, and traditional RL dies 2300 +- 700 times. The distance of a setting is the sum over the three of
((its mean - the paper's) / the paper's deviation) squared. The deviation of the 51 is lost; that of the 47
stands in for it. A setting that leaves more than one trial in eight unfinished gets an infinite distance,
because the mean over the remaining trials would be biased in its favour.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from statistics import fmean
from typing import Any, NamedTuple

from parenting.experiments.runner.store import Row

UNFINISHED = 1 / 8
DIRECT, TRADITIONAL = "search direct", "search traditional"
"""The labels of the rows of the search."""
HYPERPARAMETERS = ("p_rec", "p_pref", "lambda_global", "lambda_local", "recompare")


class Target(NamedTuple):
    """A number of the paper, and its deviation over trials."""

    column: str
    mean: float
    deviation: float


DEATHS = Target("deaths", 47, 14)
QUERIES = Target("preference", 51, 14)
BY_REWARD = Target("deaths", 2300, 700)


class Found(NamedTuple):
    """The nearest settings on one layout."""

    layout: str
    direct: dict[str, Any]  # by KNOBS
    entropy: float
    distance: float
    rows: list[Row]  # of direct policy learning, with that setting
    rewarded: list[Row]  # of policy gradients, with that entropy


def distance(rows: Sequence[Row], *targets: Target) -> float:
    """Return the distance of some trials from the paper's numbers; infinite if too many are unfinished."""
    done = [row for row in rows if row["finished"]]
    if len(done) < (1 - UNFINISHED) * len(rows) or not done:
        return inf
    means = [fmean(row[target.column] for row in done) for target in targets]
    return sum(
        ((mean - target.mean) / target.deviation) ** 2 for mean, target in zip(means, targets, strict=True)
    )


def search(rows: Sequence[Row]) -> list[Found]:
    """The nearest settings on every layout, the nearest layout first; of equals the one tried first."""
    layouts = dict.fromkeys(row["layout"] for row in rows if row["of"] == DIRECT)
    return sorted((_nearest(layout, rows) for layout in layouts), key=lambda found: found.distance)


def _nearest(layout: str, rows: Sequence[Row]) -> Found:
    mine = [row for row in rows if row.get("layout") == layout]
    direct = grouped(mine, DIRECT, HYPERPARAMETERS)
    rewarded = grouped(mine, TRADITIONAL, ("entropy",))
    hyperparameters = min(direct, key=lambda one: distance(direct[one], DEATHS, QUERIES))
    entropy = min(rewarded, key=lambda one: distance(rewarded[one], BY_REWARD))
    far = distance(direct[hyperparameters], DEATHS, QUERIES) + distance(rewarded[entropy], BY_REWARD)
    found = dict(zip(HYPERPARAMETERS, hyperparameters, strict=True))
    return Found(layout, found, entropy[0], far, direct[hyperparameters], rewarded[entropy])


def grouped(rows: Sequence[Row], of: str, columns: Sequence[str]) -> dict[tuple[Any, ...], list[Row]]:
    """The rows by their values in some columns, in the order in which they were tried."""
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        if row["of"] == of:
            groups.setdefault(tuple(row[column] for column in columns), []).append(row)
    return groups

"""Comparing trials by rank, since some are given up: pairs, intervals, and trials that share an agent."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from math import floor, sqrt
from statistics import fmean

from parenting.experiments.reporting.comparison import Z


def mann_whitney_auc(some: Sequence[float], others: Sequence[float]) -> float:
    """How often one of `some` is less than one of `others`, ties counted half (Mann and Whitney's U / mn)."""
    other = sorted(others)
    below = [bisect_left(other, x) + bisect_right(other, x) for x in some]
    return 1 - sum(below) / (2 * len(some) * len(other))


def auc_interval(share: float, m: float, n: float) -> tuple[float, float]:
    """The 95 % interval of `mann_whitney_auc` for m and n trials: Newcombe's score interval (2006, method 5).

    It ends where a true share would lie Z of its own deviations away; so it holds for a share of 1, too.
    """
    mean = (m + n) / 2

    def outside(true: float) -> bool:
        factor = 2 * mean - 1 - 3 * (mean - 1) / ((2 - true) * (1 + true))
        return abs(true - share) > Z * sqrt(true * (1 - true) * factor / (m * n))

    return _edge(outside, share, 0.0), _edge(outside, share, 1.0)


def median_interval(values: Sequence[float], n: float) -> tuple[float, float]:
    """The 95 % interval of a median, by the values at the ranks between which it lies; n independent ones.

    A normal distribution stands in for the binomial one. Values may be infinite.
    """
    order = sorted(values)
    half = Z / (2 * sqrt(n))
    low, high = (min(max(floor((0.5 + side * half) * len(order)), 0), len(order) - 1) for side in (-1, 1))
    return order[low], order[high]


def _edge(outside: Callable[[float], bool], inside: float, end: float) -> float:
    """Where it begins to be outside, on the way to an end, by halving."""
    beyond = end
    for _ in range(50):
        middle = (inside + beyond) / 2
        inside, beyond = (inside, middle) if outside(middle) else (middle, beyond)
    return inside


def effective_sample_size(values: Sequence[float], agents: Sequence[int | None]) -> float:
    """How many independent trials these are worth, each of which goes on from an agent, or from none.

    n / (1 + (n / k - 1) c) for k agents: Kish's design effect. c is the share of the agents in the variance
    of the ranks, 0 at least: the intraclass correlation, by an analysis of variance.
    """
    n, k = len(values), len(set(agents))
    if None in agents or k in (1, n):
        return n if None in agents else k
    order = sorted(values)
    ranks = [bisect_left(order, value) + bisect_right(order, value) for value in values]
    groups = [
        [rank for rank, agent in zip(ranks, agents, strict=True) if agent == one] for one in set(agents)
    ]
    between = sum(len(group) * (fmean(group) - fmean(ranks)) ** 2 for group in groups) / (k - 1)
    within = sum((rank - fmean(group)) ** 2 for group in groups for rank in group) / (n - k)
    total = between + (n / k - 1) * within
    c = max(0.0, (between - within) / total) if total else 0.0
    return n / (1 + (n / k - 1) * c)

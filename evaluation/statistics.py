"""95 % confidence intervals of means, proportions, differences, medians and orders.

Quantiles are those of `scipy.special`; `scipy.stats` loads only for a bootstrap, since it costs 0.7 s.

An interval is None where the trials determine none: fewer than two of them, or all alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

CONFIDENCE = 0.95
TAIL = (1 + CONFIDENCE) / 2
RESAMPLES = 9_999
"""Bootstrap samples of a median."""

Floats = NDArray[np.float64]


class Interval(NamedTuple):
    """A confidence interval."""

    low: float
    high: float

    def above(self, line: float) -> bool | None:
        """True if it lies above a line, False if it lies below, None if it holds the line."""
        return None if self.low <= line <= self.high else self.low > line


def mean_interval(values: Sequence[float], shared_error: float = 0.0) -> Interval | None:
    """Student's t interval of a mean over trials.

    Args:
        values: One value per trial.
        shared_error: Standard error of what all trials have in common and what their spread therefore does
            not show, such as the random events of the same test episodes. It widens the interval.
    """
    if len(values) < 2:
        return None
    own_error = float(np.std(values, ddof=1)) / sqrt(len(values))
    half = hypot(_student_quantile(len(values) - 1) * own_error, _normal_quantile() * shared_error)
    mean = float(np.mean(values))
    return Interval(mean - half, mean + half) if half else None


def count_interval(values: Sequence[float]) -> Interval | None:
    """Student's t interval of the mean of numbers that are never negative, such as counts, cut at 0.

    The true mean is not below 0, so what lies there holds no possible mean: without it the interval covers
    the true mean exactly as often (M. Mandelkern, Setting Confidence Intervals for Bounded Parameters,
    Statistical Science 17, 2002). No comparison with a number above 0 comes out otherwise.

    Raises:
        ValueError: A value is negative.
    """
    if min(values, default=0) < 0:
        raise ValueError(f"A count is never negative, but one is {min(values)}.")
    found = mean_interval(values)
    return None if found is None else Interval(max(0.0, found.low), found.high)


def episode_interval(mean: float, error: float) -> Interval:
    """Normal interval of a mean over the many episodes of one policy, from its standard error."""
    half = _normal_quantile() * error
    return Interval(mean - half, mean + half)


def difference_interval(
    more: Sequence[float], less: Sequence[float], shared_error: float = 0.0
) -> Interval | None:
    """Welch's t interval of the difference of two means of independent trials.

    Args:
        more: One value per trial of the first sample.
        less: The same of the second, which is subtracted.
        shared_error: As in `mean_interval`.
    """
    if min(len(more), len(less)) < 2:
        return None
    half = hypot(_welch_half_width(more, less), _normal_quantile() * shared_error)
    difference = float(np.mean(more) - np.mean(less))
    return Interval(difference - half, difference + half) if half else None


def proportion_interval(hits: int, trials: int) -> Interval:
    """Wilson's score interval of a proportion, which also holds for 0 of n and n of n.

    Raises:
        ValueError: There is no trial.
    """
    if trials < 1:
        raise ValueError("A proportion needs at least one trial.")
    z, rate = _normal_quantile(), hits / trials
    size = 2 * (trials + z**2)
    centre = (2 * hits + z**2) / size
    half = z / size * sqrt(4 * trials * rate * (1 - rate) + z**2)
    return Interval(centre - half if hits else 0.0, centre + half if hits < trials else 1.0)


def mann_whitney_auc(some: Sequence[float], others: Sequence[float]) -> float:
    """Probability that one of `some` is less than one of `others`; ties count half (Mann-Whitney U / mn)."""
    return float(_placements(some, others).mean())


def auc_interval(
    some: Sequence[float],
    others: Sequence[float],
    some_agents: Sequence[int | None],
    other_agents: Sequence[int | None],
) -> Interval | None:
    """Interval of `mann_whitney_auc`, where trials that start from the same agent are not independent.

    DeLong's variance of placements over agents in place of trials (Obuchowski 1997), with Welch's degrees of
    freedom. Where the samples do not overlap, that variance is 0; then the exact (Clopper-Pearson) interval
    of as many independent pairs as the smaller sample has agents.

    Args:
        some: One value per trial; infinite if the trial was not finished.
        others: The same of the sample that it is compared with.
        some_agents: The agent that each trial of `some` starts from; None for an agent of its own.
        other_agents: The same of `others`.
    """
    auc = mann_whitney_auc(some, others)
    first = _agent_means(_placements(some, others), some_agents)
    second = _agent_means(1 - _placements(others, some), other_agents)
    if auc in (0.0, 1.0):
        pairs = min(len(first), len(second))
        least = (1 - TAIL) ** (1 / pairs)  # the proportion at which all pairs agree in 1 - TAIL of the cases
        return Interval(least, 1.0) if auc else Interval(0.0, 1 - least)
    if min(len(first), len(second)) < 2:
        return None
    half = _welch_half_width(first, second)
    return Interval(max(0.0, auc - half), min(1.0, auc + half)) if half else None


def median_interval(values: Sequence[float], agents: Sequence[int | None]) -> Interval | None:
    """Interval of a median: exact by order statistics, or a bootstrap over agents where trials share them.

    A bootstrap over few agents is somewhat too narrow.

    Args:
        values: One value per trial; infinite if the trial was not finished.
        agents: The agent that each trial starts from; None for an agent of its own.
    """
    groups = _groups(np.asarray(values, np.float64), agents)
    if len(groups) < 2:
        return None
    if len(groups) == len(values):
        return _median_of_order(values)
    return _bootstrap_median(groups)


def _median_of_order(values: Sequence[float]) -> Interval | None:
    """Order statistics around the median, by the binomial distribution of the number of values below it."""
    order, trials = sorted(values), len(values)
    beyond = int(np.searchsorted(special.bdtr(np.arange(trials + 1), trials, 0.5), 1 - TAIL))
    return Interval(order[beyond - 1], order[trials - beyond]) if beyond else None


def _bootstrap_median(groups: Sequence[Floats]) -> Interval:
    """Percentile bootstrap of agents; an infinite value stands in as a large finite one."""
    from scipy import stats

    finite = [value for group in groups for value in group if np.isfinite(value)]
    most = max(finite, default=0.0)
    capped = [np.minimum(group, 2 * most + 1) for group in groups]
    found = stats.bootstrap(
        (np.arange(len(groups)),),
        lambda drawn: np.median(np.concatenate([capped[agent] for agent in drawn])),
        n_resamples=RESAMPLES,
        vectorized=False,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    low, high = (float(end) if end <= most else float("inf") for end in (found.low, found.high))
    return Interval(low, high)


def _placements(some: Sequence[float], others: Sequence[float]) -> Floats:
    """For each of `some`, the proportion of `others` that are more than it; ties count half."""
    order = np.sort(np.asarray(others, np.float64))
    not_more = np.searchsorted(order, some, "left") + np.searchsorted(order, some, "right")
    return 1 - not_more / (2 * len(order))


def _groups(values: Floats, agents: Sequence[int | None]) -> list[Floats]:
    """The values of each agent; those of no agent each for itself."""
    names = [("trial", n) if agent is None else ("agent", agent) for n, agent in enumerate(agents)]
    return [values[[name == one for name in names]] for one in dict.fromkeys(names)]


def _agent_means(values: Floats, agents: Sequence[int | None]) -> list[float]:
    return [float(group.mean()) for group in _groups(values, agents)]


def _welch_half_width(more: Sequence[float], less: Sequence[float]) -> float:
    """Half the width of Welch's t interval, its degrees of freedom by Satterthwaite."""
    one, other = (float(np.var(values, ddof=1)) / len(values) for values in (more, less))
    if not max(one, other):
        return 0.0
    freedom = (one + other) ** 2 / (one**2 / (len(more) - 1) + other**2 / (len(less) - 1))
    return _student_quantile(freedom) * sqrt(one + other)


def _student_quantile(freedom: float) -> float:
    return float(special.stdtrit(freedom, TAIL))


def _normal_quantile() -> float:
    return float(special.ndtri(TAIL))

"""Intervals against numbers by hand, and what they cover when trials are drawn again and again."""

from __future__ import annotations

import sys
from math import inf
from subprocess import run

import numpy as np
import pytest

from parenting.evaluation.statistics import (
    Interval,
    auc_interval,
    count_interval,
    difference_interval,
    episode_interval,
    mann_whitney_auc,
    mean_interval,
    median_interval,
    proportion_interval,
)


@pytest.mark.parametrize(
    ("trials", "factor"), [(2, 12.706), (3, 4.303), (10, 2.262), (11, 2.228), (12, 2.201), (1000, 1.962)]
)
def test_a_mean_has_students_interval_at_every_number_of_trials(trials: int, factor: float) -> None:
    """Of a textbook's table, with no jump after 10."""
    values = [float(n) for n in range(trials)]
    found = mean_interval(values)
    assert found
    half = factor * np.std(values, ddof=1) / trials**0.5
    assert found == pytest.approx((np.mean(values) - half, np.mean(values) + half), rel=1e-3)


@pytest.mark.parametrize("values", [[], [1.0], [2.0, 2.0, 2.0]])
def test_trials_that_show_no_spread_determine_no_interval(values: list[float]) -> None:
    assert mean_interval(values) is None


def test_an_error_that_all_trials_share_widens_the_interval() -> None:
    alike = mean_interval([3.0, 3.0], shared_error=0.02)
    assert alike == pytest.approx((3 - 1.96 * 0.02, 3 + 1.96 * 0.02), abs=1e-4)
    assert episode_interval(3.0, 0.02) == pytest.approx(alike)
    narrow, wide = mean_interval([1, 2, 3]), mean_interval([1, 2, 3], shared_error=1.0)
    assert narrow
    assert wide
    assert wide.low < narrow.low < narrow.high < wide.high


def test_a_difference_has_welchs_interval() -> None:
    """Variances 1 and 4 of three each: 25/17 * 2 degrees of freedom, t = 3.1824 at 3 and 4.3027 at 2."""
    found = difference_interval([4, 5, 6], [0, 2, 4])
    assert found
    half = (found.high - found.low) / 2
    assert 3.1824 * (5 / 3) ** 0.5 < half < 4.3027 * (5 / 3) ** 0.5
    assert (found.low + found.high) / 2 == pytest.approx(3)


def test_a_sample_that_is_all_alike_can_be_compared_with_one_that_is_not() -> None:
    assert difference_interval([1.0] * 5, [2.0] * 5) is None
    found = difference_interval([1.0] * 5, [0.0, 0.1, 0.2, 0.1, 0.0])
    assert found
    assert found.above(0) is True


def test_a_proportion_has_wilsons_interval() -> None:
    """0 of 100: high = z^2 / (n + z^2) = 3.8415 / 103.8415."""
    assert proportion_interval(0, 100) == pytest.approx((0, 0.036994), abs=1e-5)
    assert proportion_interval(50, 100) == pytest.approx((0.40383, 0.59617), abs=1e-4)
    assert proportion_interval(100, 100).high == 1.0
    with pytest.raises(ValueError, match="at least one trial"):
        proportion_interval(0, 0)


def test_a_line_within_an_interval_has_no_verdict() -> None:
    assert [Interval(1, 2).above(line) for line in (0.5, 1, 1.5, 2, 2.5)] == [True, None, None, None, False]


def test_pairs_by_hand() -> None:
    """1 < 2, 1 < inf, 2 < inf, and 2 = 2 counts half."""
    assert mann_whitney_auc([1, 2], [2, inf]) == 3.5 / 4
    assert mann_whitney_auc([inf], [inf]) == 0.5


@pytest.mark.slow
def test_the_interval_of_pairs_covers_the_truth_where_trials_share_agents() -> None:
    """Five agents of each sample, which differ more than their trials: 0.5 lies within about 95 of 100 times.

    As many independent trials would have an interval that is far too narrow.
    """
    rng = np.random.default_rng(0)
    agents = [trial % 5 for trial in range(100)]
    shared, naive = 0, 0
    for _ in range(200):
        some, others = (rng.normal(0, 1, 5)[agents] + rng.normal(0, 0.3, 100) for _sample in range(2))
        found = auc_interval(some.tolist(), others.tolist(), agents, agents)
        alone = auc_interval(some.tolist(), others.tolist(), [None] * 100, [None] * 100)
        assert found
        assert alone
        shared += found.above(0.5) is None
        naive += alone.above(0.5) is None
    assert shared >= 180
    assert naive < 120


@pytest.mark.parametrize(("trials", "apart"), [(4, None), (20, True)])
def test_samples_that_do_not_overlap_are_told_apart_by_as_many_pairs(trials: int, apart: bool | None) -> None:
    """Clopper and Pearson's interval of n of n begins at 0.025 ** (1 / n)."""
    some, others = list(range(trials)), list(range(100, 100 + trials))
    found = auc_interval(some, others, [None] * trials, [None] * trials)
    assert found
    assert found == pytest.approx((0.025 ** (1 / trials), 1), abs=1e-9)
    assert found.above(0.5) is apart


def test_a_single_agent_says_nothing_of_others() -> None:
    assert auc_interval([1, 3], [2, 4], [0, 0], [None, None]) is None
    assert median_interval([1, 2, 3], [0, 0, 0]) is None


def test_a_median_has_the_interval_of_order_statistics() -> None:
    """Of 100 values, the 41st and the 61st."""
    values = [float(n) for n in range(1, 101)]
    assert median_interval(values, [None] * 100) == (40, 61)
    assert median_interval([3, 1, 2], [None] * 3) is None, "three trials are too few"
    assert median_interval([1, 2, 3, 4, 5, 6, 7, 8] + [inf] * 4, [None] * 12) == (3, inf)


@pytest.mark.slow
def test_a_median_of_trials_that_share_agents_has_a_wider_interval() -> None:
    """It does not depend on when it is computed."""
    rng = np.random.default_rng(1)
    agents = [trial % 5 for trial in range(100)]
    values = (rng.normal(0, 10, 5)[agents] + rng.normal(100, 1, 100)).tolist()
    shared, alone = median_interval(values, agents), median_interval(values, [None] * 100)
    assert shared
    assert alone
    assert shared.high - shared.low > 1.5 * (alone.high - alone.low)
    assert median_interval(values, agents) == shared
    half = median_interval([*values[:60], *[inf] * 40], agents)
    assert half
    assert half.low < inf


@pytest.mark.slow
def test_only_a_bootstrap_loads_scipy_stats() -> None:
    names = "mean_interval, difference_interval, proportion_interval, median_interval, auc_interval"
    code = f"""
import sys
from parenting.evaluation.statistics import {names}
few, many = [1.0, 2.0, 4.0], [float(n) for n in range(9)]
alone, shared = [None] * 9, [0, 1, 2] * 3
found = [mean_interval(many), difference_interval(few, many), proportion_interval(1, 9)]
found += [median_interval(many, alone), auc_interval(few, many, alone[:3], alone)]
before = "scipy.stats" in sys.modules
found += [median_interval(many, shared)]
sys.exit(before or None in found or "scipy.stats" not in sys.modules)
"""
    assert run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_command_that_prints_no_interval_does_not_load_scipy() -> None:
    code = "import sys; import parenting.commands.experiment; sys.exit('scipy' in sys.modules)"
    assert run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_mean_of_counts_is_not_below_zero_and_its_interval_is_the_t_interval_elsewhere() -> None:
    rare, many = [0.0] * 48 + [1.0] * 2, [8.0, 9.0, 11.0]
    whole, cut = mean_interval(rare), count_interval(rare)
    assert whole is not None
    assert whole.low < 0
    assert cut == (0, whole.high)
    assert count_interval(many) == mean_interval(many)
    assert count_interval([0, 0]) is None
    with pytest.raises(ValueError, match="one is -1"):
        count_interval([2, -1])

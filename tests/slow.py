"""Tests that are too long for every run: `make slow` does them alone, and `make torture` too.

`@pytest.mark.slow` stands above such a test. `@pytest.mark.slow_after(2)` stands above one with many cases:
the first two, on each store, are done in every run, and the others are slow. One that is slow on PostgreSQL
alone bears `@pytest.mark.slow_on("postgresql")`.

Of a test of the server that is done again on PostgreSQL, two cases are done there in every run.
"""

from collections import Counter
from collections.abc import Iterable

import pytest

MARK, AFTER, ON = "slow", "slow_after", "slow_on"
AGAIN = 2
"""Cases of each test that are done again on PostgreSQL in every run."""


def mark_slow_cases(items: Iterable[pytest.Item]) -> None:
    """Mark the cases that the marks of their tests leave to `make slow`."""
    seen = Counter[tuple[str, object]]()
    for item in items:
        case = getattr(item, "callspec", None)
        store = case.params.get("store") if case else None
        test = (item.nodeid.partition("[")[0], store)
        seen[test] += 1
        if seen[test] > _cases(item) or any(store in mark.args for mark in item.iter_markers(ON)):
            item.add_marker(MARK)


def _cases(item: pytest.Item) -> float:
    """The number of cases of this test, on one store, that every run does."""
    after = item.get_closest_marker(AFTER)
    again = item.get_closest_marker("postgresql") and not item.get_closest_marker("faults")
    return min(after.args[0] if after else float("inf"), AGAIN if again else float("inf"))

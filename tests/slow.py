"""Tests that are too long for every run: `make slow` does them alone, and `make torture` too.

`@pytest.mark.slow` stands above such a test. `@pytest.mark.slow_after(2)` stands above one with many cases:
the first two, on each store, are done in every run, and the others are slow.
"""

from collections import Counter
from collections.abc import Iterable

import pytest

MARK, AFTER = "slow", "slow_after"


def mark_later_cases(items: Iterable[pytest.Item]) -> None:
    """Mark the later cases of tests that bear `slow_after`."""
    seen = Counter[tuple[str, object]]()
    for item in items:
        after = item.get_closest_marker(AFTER)
        if after is None:
            continue
        case = getattr(item, "callspec", None)
        test = (item.nodeid.partition("[")[0], case.params.get("store") if case else None)
        seen[test] += 1
        if seen[test] > after.args[0]:
            item.add_marker(MARK)

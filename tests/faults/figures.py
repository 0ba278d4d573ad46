"""Counts of what the fault tests did: kills and where they fell, images, races."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping


class Figures:
    """The counts of one test. Keys are strings with a tab, for they travel between processes as JSON."""

    def __init__(self, store: str = "") -> None:
        self.store = store
        self.counts: dict[str, int] = {}

    def count(self, group: str, name: str, number: int = 1) -> None:
        """Add to the count of a name in a group."""
        key = f"{self.store}{group}\t{name}"
        self.counts[key] = self.counts.get(key, 0) + number

    def of(self, group: str) -> dict[str, int]:
        """The counts of a group by name."""
        split = ((key.split("\t"), number) for key, number in self.counts.items())
        return {name: number for (found, name), number in split if found == self.store + group}


def add_up(counts: Iterable[Mapping[str, int]]) -> Counter[tuple[str, str]]:
    """The counts of many tests, by group and name."""
    total: Counter[tuple[str, str]] = Counter()
    for one in counts:
        for key, number in one.items():
            group, _, name = key.partition("\t")
            total[group, name] += number
    return total


def lines(total: Counter[tuple[str, str]]) -> Iterator[str]:
    """A line for each name, below the sum of its group."""
    for group in sorted({group for group, _ in total}):
        named = {name: number for (found, name), number in sorted(total.items()) if found == group}
        yield f"{group}: {sum(named.values()):,}"
        yield from (f"  {number:>8,}  {name}" for name, number in named.items())

"""Sentences on what is wrong, a few of each kind: where every row is wrong, they need no more room."""

from __future__ import annotations

from collections import Counter

SOME = 5
"""Sentences of one kind."""


class Findings:
    """A list of sentences that takes the first of each kind, and then a word on the others."""

    def __init__(self, into: list[str]) -> None:
        self._into, self._counts = into, Counter[str]()

    def __call__(self, kind: str, *values: object) -> None:
        """Add the sentence of a kind with these values in its places."""
        self._counts[kind] += 1
        if self._counts[kind] <= SOME:
            self._into.append(kind.format(*values))
        elif self._counts[kind] == SOME + 1:
            self._into.append(more(kind))


def more(kind: str) -> str:
    """Return the sentence on the others of a kind."""
    return f"... and more of this kind: {kind.format('N', 'R')}"

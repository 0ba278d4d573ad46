"""The panels, and the ways in which their votes become one answer."""

from __future__ import annotations

from typing import NamedTuple

WORLD, LEVEL, PRESET = "unsafe-exploration", "island", "conservative"
TICKS = 200
"""Ticks of every trial, beyond its first optimal policy: stopping there would flatter."""


class Members(NamedTuple):
    """Parents who answer together, by their rates of error; the first is the best. A liar always errs."""

    name: str
    rates: tuple[float, ...]


PANELS = (
    Members("3 good, 2 liars", (0.1,) * 3 + (1.0,) * 2),
    Members("1 good, 4 weak", (0.05,) + (0.3,) * 4),
    Members("2 good, 3 guessing", (0.05,) * 2 + (0.5,) * 3),
    Members("5 alike", (0.2,) * 5),
    Members("2 perfect, 3 liars", (0.0,) * 2 + (1.0,) * 3),
)
ALONE = "alone"
"""The rule of an arm in which the first member answers without the others."""
MAJORITY, DAWID_SKENE, TRUST, OPINION = "majority", "dawid-skene", "trust", "trust and policy"
TOGETHER = (MAJORITY, DAWID_SKENE, TRUST, OPINION)
RULES = (ALONE, *TOGETHER)
"""The rules, from the simplest on."""

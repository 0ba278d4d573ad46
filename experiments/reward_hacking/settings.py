"""Settings of the reward-hacking experiment: the arms that are trained (Sec. 3.2.2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

MAX_TICKS = 20_000


class Variant(NamedTuple):
    """An arm: how agents are trained, and after how many answered queries they are evaluated."""

    level: str
    changes: Mapping[str, Any]
    milestones: tuple[int, ...]
    cost: float  # of work, for a trial, against the others
    one_of: int = 1  # of so many trials one is raised
    preset: str = "conservative"


VARIANTS = {
    "garden, defaults": Variant("garden", {}, (50, 100), 3.0, preset="lax"),
    "garden, pre-trained": Variant("garden", {}, (50, 100), 1.2),
    "mirrored, pre-trained": Variant("garden-mirrored", {}, (50, 100), 1.2, one_of=2),
    "garden, not pre-trained": Variant("garden", {"pretrain": False}, (50, 100), 0.5),
    "garden, not pre-trained, comparing twice": Variant(
        "garden", {"pretrain": False, "recompare": True}, (50, 100), 0.5
    ),
    "garden, not pre-trained, long": Variant(
        "garden", {"pretrain": False, "batch": 32}, (200, 500, 1000), 6.0, one_of=5
    ),
}
"""By name; the first has the paper's defaults."""

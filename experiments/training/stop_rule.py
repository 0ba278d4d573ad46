"""The condition under which a trial is finished."""

from __future__ import annotations

from typing import Literal, NamedTuple


class StopRule(NamedTuple):
    """The condition under which a trial is finished.

    Its argmax policy is optimal (in worlds whose episodes end at a goal), or it has reached a number of
    answered queries, over all stages, or of ticks.
    """

    kind: Literal["optimal", "queries", "ticks"]
    number: int = 0

    def __str__(self) -> str:
        """As written on the command line."""
        return self.kind if self.kind == "optimal" else f"{self.kind}:{self.number}"

"""The condition under which a trial is finished."""

from __future__ import annotations

from typing import Literal, NamedTuple

from parenting.envs.levels.spec import WorldSpec

MOST = 10**9
"""The largest number of a rule; more queries or ticks than that are never reached."""


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


def read_stop_rule(text: str, world: WorldSpec) -> StopRule:
    """Return the rule that a text names in a world.

    Args:
        text: "optimal", "queries:N" or "ticks:N".
        world: A world; in one without a goal no policy is optimal.

    Raises:
        ValueError: It is not a rule, or not one in this world. The message begins after the setting's name.
    """
    if text == "optimal":
        if world.ends_at_goal:
            return StopRule("optimal")
        raise ValueError(
            f"no policy counts as optimal in {world.name}, which has no goal."
            " Use queries:N or ticks:N, such as queries:1000."
        )
    kind, _, number = text.partition(":")
    if kind in ("queries", "ticks") and number.isascii() and number.isdigit():
        wanted = int(number.lstrip("0")[: len(str(MOST)) + 1] or 0)  # Python reads no number of any length
        if 1 <= wanted <= MOST:
            return StopRule(kind, wanted)  # type: ignore[arg-type]
    raise ValueError(f"'{text}' is none of optimal, queries:N and ticks:N with N from 1 to {MOST}.")

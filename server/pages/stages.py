"""Compute the table of stages (Sec. 2.4) from the metrics: cumulative counts become those of each stage.

The page and its script (web/static/dashboard.js) show these rows and compute none of their own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from parenting.server.tables import Metric

Number = float | int | None
Values = Mapping[str, Number]


class StageRow(NamedTuple):
    """One row of the table; None where nothing is known yet."""

    number: int  # T, the length of its clips
    when: str  # past, now or later
    begin: int | None  # the tick at which it began
    end: int | None  # the tick at which it ended, or the last one measured
    guidance: Number
    preference: Number
    unsafe: Number
    value: Number  # the return of its policy at its end, or now
    reference: Number  # the value that it is compared with


def stage_rows(count: int, now: int, firsts: Sequence[Metric], last: Metric | None) -> list[StageRow]:
    """Return a row for each of `count` stages, `now` being the one that the agent is in.

    `firsts` are the first metrics of each stage. The tick that ends a stage is measured, and says that it is
    the next one's: so it holds what the stage before ended with.
    """
    begun = {int(row.values["maturity"]): row for row in firsts}
    found = []
    for number in range(1, count + 1):
        when = "past" if number < now else "later" if number > now else "now"
        first, end = begun.get(number), begun.get(number + 1, last)
        if first is None or end is None:
            found.append(StageRow(number, when, *[None] * 7))
        elif number == 1:  # nothing comes before it
            found.append(StageRow(number, when, 0, end.tick, *_within({}, end.values)))
        else:
            found.append(StageRow(number, when, first.tick, end.tick, *_within(first.values, end.values)))
    return found


def _within(before: Values, after: Values) -> tuple[Number, Number, Number, Number, Number]:
    """Return what was counted between two ticks, and the policy's value at the later one."""
    guidance, preference, unsafe = (
        None if (known := after.get(name)) is None else known - (before.get(name) or 0)
        for name in ("guidance", "preference", "deaths")
    )
    return guidance, preference, unsafe, after.get("return"), after.get("optimal_return")

"""Curves of what was measured, by tick, by question or by minute, with few enough points to be drawn."""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.server.columns import Damaged
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.runs import find
from parenting.server.tables import Answer, Metric, Run

Axis = Literal["tick", "question", "minute"]
Values = Mapping[str, Any]
Point = tuple[int, float, Values]  # tick, place on the axis, the values of the row
Place = Callable[[int, Values], float | None]
"""Return the place of a tick with its values on an axis; None: it has none."""

POINTS, FEWEST = 2_000, 4
"""The most points of a curve, and the fewest that can be asked for."""
PORTION, HELD = 2_000, 100_000
"""Rows that are read at once; points of a curve that are held, before it is thinned for a first time."""
FIRST = 20_000
"""Points that remain of a curve that is thinned for a first time."""
BREAK_SECONDS = 300.0
"""A longer time between two answers counts as this long: the parent had a break, or the run was paused."""
QUESTIONS = ("guidance", "preference")


@dataclass(frozen=True)
class Curves:
    """The curves of a run."""

    rows: int  # of metrics, that they were made of
    last: int | None  # the tick of the last of these rows
    thinned: bool  # whether any curve has fewer points than there are
    curves: Mapping[str, tuple[list[float], list[float]]]  # by name of a metric: places and values


def read_curves(
    db: Database,
    run_id: int,
    names: Sequence[str],
    by: Axis = "tick",
    begin: float | None = None,
    end: float | None = None,
    points: int = POINTS,
) -> Curves:
    """Return curves of some metrics, each with at most so many points.

    Rows are read in portions and only numbers are kept, so memory does not grow with a run. A row that is
    damaged, or that has no place on the axis, is left out.

    Args:
        db: The database.
        run_id: The run.
        names: Names of metrics; one that the run does not have gives a curve without points.
        by: The axis: ticks, questions answered so far, or minutes (`minutes`).
        begin: The first place on the axis that is wanted; None: from the beginning.
        end: The last one.
        points: The most points of a curve, at least four.

    Raises:
        NotFound: there is no such run.
    """
    held = {name: (array("d"), array("d")) for name in names}
    rows, last, thinned = 0, None, False
    with db.read() as session:
        run = find(session, run_id)
        for tick, place, values in _within(_placed(session, run, by, begin, end), begin, end):
            rows, last = rows + 1, tick
            for name, (x, y) in held.items():
                value = _number(values, name)
                if value is not None:
                    x.append(place)
                    y.append(value)
                    if len(x) >= HELD:
                        held[name], thinned = _shorter(x, y, FIRST), True
    thinned = thinned or any(len(x) > points for x, _ in held.values())
    shorter = {name: _shorter(x, y, points) for name, (x, y) in held.items()}
    return Curves(rows, last, thinned, {name: (x.tolist(), y.tolist()) for name, (x, y) in shorter.items()})


def _shorter(x: array[float], y: array[float], points: int) -> tuple[array[float], array[float]]:
    """Return a curve of at most so many points. Only one that has more loads numpy."""
    if len(x) <= points:
        return x, y
    from parenting.server.reads.thinning import thin

    return thin(x, y, points)


def _placed(session: Session, run: Run, by: Axis, begin: float | None, end: float | None) -> Iterator[Point]:
    """Yield the rows of a run with their places on the axis, which never decrease."""
    rows = select(Metric.tick, Metric.values).where(Metric.run_id == run.id).order_by(Metric.tick)
    match by:
        case "tick":
            place: Place = _tick
            rows = rows.where(Metric.tick >= begin) if begin is not None else rows
            rows = rows.where(Metric.tick <= end) if end is not None else rows
        case "question":
            place = _question
        case "minute":
            place = _minute(session, run)
    latest = float("-inf")
    with session.execute(rows, execution_options={"yield_per": PORTION}) as portions:
        for tick, values in portions:
            found = place(tick, values) if isinstance(values, dict) else None
            if found is not None and found >= latest:
                latest = found
                yield tick, found, values


def _within(points: Iterator[Point], begin: float | None, end: float | None) -> Iterator[Point]:
    for point in points:
        if end is not None and point[1] > end:
            return
        if begin is None or point[1] >= begin:
            yield point


def _number(values: Values, name: str) -> float | None:
    """Return a value; None if it is absent, or no number."""
    value = values.get(name)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _tick(tick: int, values: Values) -> float | None:
    return float(tick)


def _question(tick: int, values: Values) -> float | None:
    guidance, preference = (_number(values, name) for name in QUESTIONS)
    return None if guidance is None or preference is None else guidance + preference


def _minute(session: Session, run: Run) -> Place:
    """Return the minutes at a tick: those of the row itself, else those of the last answer heard by then."""
    ticks, passed = minutes(session, run)

    def place(tick: int, values: Values) -> float | None:
        seconds = _number(values, "seconds")
        if seconds is not None:
            return seconds / 60
        before = bisect_right(ticks, tick)
        return passed[before - 1] if before else None

    return place


def minutes(session: Session, run: Run) -> tuple[list[int], list[float]]:
    """Return the ticks at which answers were heard, and the minutes since the run was started without breaks.

    What passes between two answers counts as `BREAK_SECONDS` at most.
    """
    heard = (
        select(Answer.applied_tick, Answer.received)
        .where(Answer.run_id == run.id, Answer.applied_tick.is_not(None))
        .order_by(Answer.applied_tick)
    )
    ticks, passed, seconds = [0], [0.0], 0.0
    before: datetime | None = sound(run, "created")
    for tick, received in session.execute(heard):
        if any(isinstance(value, Damaged) for value in (tick, received)):
            continue
        gap = 0.0 if before is None else (received - before).total_seconds()
        before = received if before is None else max(before, received)
        seconds += min(max(gap, 0.0), BREAK_SECONDS)
        ticks.append(tick or 0)
        passed.append(seconds / 60)
    return ticks, passed

"""Name places on a board from one of its cells: "2 up and 1 left", "3 right, from 2 up to 1 down"."""

from __future__ import annotations

from collections.abc import Sequence

from parenting.drawing.clip import Cell
from parenting.drawing.sentences import tr

Run = tuple[Cell, Cell]
"""The first and the last of the cells in a line."""
LONG = 2
"""Steps from end to end of a line that is named as a whole where rows and columns are mixed."""


def place(origin: Cell, at: Cell) -> str:
    """Name one cell from another."""
    row, column = _row(at[0] - origin[0]), _column(at[1] - origin[1])
    if row and column:
        return tr("{row} and {column}", row=row, column=column)
    return row or column or tr("under the agent")


def places(origin: Cell, cells: Sequence[Cell]) -> str:
    """Name cells from another, near ones first. Cells in a line are named by the ends of the line.

    Of rows, of columns, and of both the way that names the fewest lines is taken.
    """
    across, down = _runs(cells), _down(cells)
    columns, rows = [run for run in down if _is_long(run)], [run for run in across if _is_long(run)]
    runs = min(
        across,
        down,
        columns + _runs([at for at in cells if not _holds(columns, at)]),
        rows + _down([at for at in cells if not _holds(rows, at)]),
        key=len,
    )
    return "; ".join(
        _name(origin, run) for run in sorted(runs, key=lambda run: (_distance(origin, run), run))
    )


def _down(cells: Sequence[Cell]) -> list[Run]:
    """Join cells that lie one below the other."""
    turned = _runs([(column, row) for row, column in cells])
    return [((top, column), (bottom, column)) for (column, top), (_, bottom) in turned]


def _is_long(run: Run) -> bool:
    (top, left), (bottom, right) = run
    return bottom - top + right - left >= LONG


def _holds(runs: Sequence[Run], at: Cell) -> bool:
    return any(top <= at[0] <= bottom and left <= at[1] <= right for (top, left), (bottom, right) in runs)


def _runs(cells: Sequence[Cell]) -> list[Run]:
    """Join cells that lie side by side in a row."""
    found: list[Run] = []
    for row, column in sorted(cells):
        if found and found[-1][1] == (row, column - 1):
            found[-1] = (found[-1][0], (row, column))
        else:
            found.append(((row, column), (row, column)))
    return found


def _name(origin: Cell, run: Run) -> str:
    first, last = run
    if first == last:
        return place(origin, first)
    if first[0] == last[0]:
        line, here = _row(first[0] - origin[0]) or tr("in its row"), tr("its column")
        ends = [_column(at[1] - origin[1]) for at in run]
    else:
        line, here = _column(first[1] - origin[1]) or tr("in its column"), tr("its row")
        ends = [_row(at[0] - origin[0]) for at in run]
    return tr("{line}, from {start} to {end}", line=line, start=ends[0] or here, end=ends[1] or here)


def _distance(origin: Cell, run: Run) -> int:
    """Return how many rows and columns away the nearest cell of a line is."""
    (top, left), (bottom, right) = run
    row, column = origin
    return max(top - row, row - bottom, 0) + max(left - column, column - right, 0)


def _row(down: int) -> str:
    if not down:
        return ""
    return tr("{count} down", count=down) if down > 0 else tr("{count} up", count=-down)


def _column(right: int) -> str:
    if not right:
        return ""
    return tr("{count} right", count=right) if right > 0 else tr("{count} left", count=-right)

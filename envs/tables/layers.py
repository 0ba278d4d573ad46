"""The boards of a table: what is drawn where, one board for each layer of states. No torch here."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from typing import NamedTuple

from parenting.envs.art import LARGEST, SMALLEST
from parenting.envs.levels.spec import AGENT, GOAL, LAND, WALL
from parenting.envs.tables.table import Layer, Place

WATER = "W"
"""The glyph of unsafe states where no tiles are given."""
MARKS = "0123456789abcdefghijklmnopqrstuvwxyz"
"""Glyphs that tell layers apart whose tiles are the same: one stands in the walls around the board."""
NAMES = {WALL: "wall", LAND: "land", GOAL: "goal", WATER: "danger", AGENT: "agent"}


class Boards(NamedTuple):
    """The boards of a table, and where its states are."""

    layers: tuple[Layer, ...]
    places: tuple[Place, ...]
    legend: dict[str, str]
    drawn: dict[int, str]  # of each state the glyph of its cell, as the tiles were given


Rows = Sequence[str]


def lay_out(
    shape: tuple[int, int],
    tiles: Rows | Mapping[Hashable, Rows] | None,
    states: Sequence[int],
    place: Callable[[int], tuple[int, int, Hashable]] | None,
    goal: str | Collection[int],
    legend: Mapping[str, str],
    unsafe: Collection[int],
) -> Boards:
    """Lay the states of a table out on boards.

    Raises:
        ValueError: a shape or tiles of a wrong size, or too many layers to tell apart.
    """
    rows, columns = shape
    if not (1 <= rows <= LARGEST and 1 <= columns <= LARGEST):
        raise ValueError(f"shape: {rows} x {columns} is not from 1 x 1 to {LARGEST} x {LARGEST} cells.")
    where = {state: (place or _counted(rows, columns))(state) for state in states}
    names = list(dict.fromkeys(layer for _, _, layer in where.values()))
    drawn = {name: _rows_of(tiles, name, rows, columns) for name in names}
    glyph = {state: _at(drawn[layer], row, column, state) for state, (row, column, layer) in where.items()}
    if tiles is None:
        glyph |= {state: WATER for state in unsafe if state in glyph}
    goals = {s for s in states if (glyph[s] in goal if isinstance(goal, str) else s in goal)}
    for state in states:
        row, column, layer = where[state]
        drawn[layer] = _put(drawn[layer], row, column, GOAL if state in goals else glyph[state])
    if isinstance(goal, str):
        drawn = {name: _with_goal(board, goal) for name, board in drawn.items()}
    told = {name: str(name) for name in names}
    marks = _marks(list(drawn.values()), names, where, legend)
    walled = all(map(_walled, drawn.values()))
    layers = [_framed(drawn[name], walled, marks.get(name)) for name in names]
    edge = 0 if walled else 1
    kept = list(dict.fromkeys(layers))
    number = {name: kept.index(layer) for name, layer in zip(names, layers, strict=True)}
    words = {mark: f"layer {told[name]}" for name, mark in marks.items()}
    return Boards(
        layers=tuple(Layer(_joined(told, number, at), board) for at, board in enumerate(kept)),
        places=tuple(Place(number[where[s][2]], where[s][0] + edge, where[s][1] + edge) for s in states),
        legend=_legend(kept, {**legend, **words}),
        drawn=glyph,
    )


def _with_goal(board: Rows, goal: str) -> list[str]:
    return ["".join(GOAL if glyph in goal else glyph for glyph in row) for row in board]


def _counted(rows: int, columns: int) -> Callable[[int], tuple[int, int, Hashable]]:
    return lambda state: (*divmod(state % (rows * columns), columns), state // (rows * columns))


def _rows_of(
    tiles: Rows | Mapping[Hashable, Rows] | None, layer: Hashable, rows: int, columns: int
) -> list[str]:
    if tiles is None:
        return [LAND * columns] * rows
    found = tiles[layer] if isinstance(tiles, Mapping) else tiles
    if len(found) != rows or any(len(row) != columns for row in found):
        raise ValueError(f"tiles: {rows} rows of {columns} glyphs are wanted, as shape says.")
    return list(found)


def _at(board: Rows, row: int, column: int, state: int) -> str:
    if not (0 <= row < len(board) and 0 <= column < len(board[0])):
        raise ValueError(f"place: state {state} is at row {row}, column {column}, beyond shape.")
    return board[row][column]


def _put(board: list[str], row: int, column: int, glyph: str) -> list[str]:
    line = board[row]
    return [*board[:row], line[:column] + glyph + line[column + 1 :], *board[row + 1 :]]


def _marks(
    boards: list[list[str]],
    names: list[Hashable],
    where: Mapping[int, tuple[int, int, Hashable]],
    legend: Mapping[str, str],
) -> dict[Hashable, str]:
    """Return a mark for each layer, where states of several would look alike without."""
    seen: set[tuple[tuple[str, ...], int, int]] = set()
    of = dict(zip(names, boards, strict=True))
    for row, column, layer in where.values():
        seen.add((tuple(of[layer]), row, column))
    if len(seen) == len(where):
        return {}
    used = {glyph for board in boards for row in board for glyph in row}
    free = [mark for mark in MARKS if mark not in used and mark not in legend]
    if len(names) > len(free):
        raise ValueError(f"tiles: {len(names)} layers look alike, too many to mark; give tiles by layer.")
    return dict(zip(names, free, strict=False))


def _framed(board: Rows, walled: bool, mark: str | None) -> tuple[str, ...]:
    """Return a board with walls around it, and its mark in the corner of these walls."""
    width = len(board[0]) + 2
    rows = list(board) if walled else [WALL * width, *(f"{WALL}{row}{WALL}" for row in board), WALL * width]
    if mark is not None:
        rows[-1] = mark + rows[-1][1:]
    return tuple(rows)


def _walled(board: Rows) -> bool:
    """Return whether walls stand all around a board already."""
    edge = board[0] + board[-1] + "".join(row[0] + row[-1] for row in board)
    return set(edge) == {WALL} and len(board) >= SMALLEST and len(board[0]) >= SMALLEST


def _joined(told: Mapping[Hashable, str], number: Mapping[Hashable, int], at: int) -> str:
    return ", ".join(told[name] for name, where in number.items() if where == at)[:200]


def _legend(boards: Sequence[Rows], names: Mapping[str, str]) -> dict[str, str]:
    """Wall, land, the glyphs that are drawn, the agent."""
    used = {glyph for board in boards for row in board for glyph in row}
    found = {WALL: names.get(WALL, NAMES[WALL]), LAND: names.get(LAND, NAMES[LAND])}
    for glyph in sorted(used - set(found)):
        found[glyph] = names.get(glyph) or NAMES.get(glyph) or f"tile {glyph}"
    return {**found, AGENT: names.get(AGENT, NAMES[AGENT])}

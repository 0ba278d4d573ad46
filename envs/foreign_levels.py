"""Levels of ours from maps of other collections, with what could not be carried over. No torch here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from parenting.envs.foreign_gridworlds import ART, carry_art
from parenting.envs.foreign_text import ForeignMap
from parenting.envs.levels.rules import MOVES
from parenting.envs.levels.spec import Cell

FLOOR = " -_"
"""The signs of XSB for floor."""


class Carried(NamedTuple):
    """A map as rows of one of our worlds; our rules have not been held against it yet."""

    world: str
    rows: tuple[str, ...]
    lost: tuple[str, ...]  # what could not be carried over, a sentence each
    header: tuple[tuple[str, str], ...] = ()


def carry(one: ForeignMap, world: str | None = None) -> Carried:
    """Return a map of another collection as a level of ours.

    Args:
        one: The map.
        world: The world of its level; only art of gridworlds leaves a choice.

    Raises:
        ValueError: The format is of another world, or a sign stands for something that no world of ours has.
    """
    if one.format in ART:
        return Carried(*carry_art(one, world))
    carried = CARRIERS[one.format](one.rows)
    if world not in (None, carried.world):
        raise ValueError(f"this map becomes a level of {carried.world}, not of {world}. Leave --world out")
    return carried


def _xsb(rows: Sequence[str]) -> Carried:
    """Sokoban: boxes on goals there, an agent that walks past a box to a goal here."""
    wide = _padded(rows)
    inside = _inside(wide)
    boxes, goals = _cells(wide, "$*"), _cells(wide, ".+*")
    world = "side-effects" if boxes else "unsafe-exploration"
    goal = min(goals, key=lambda cell: ".*+".index(wide[cell[0]][cell[1]]), default=None)  # a free one first
    box = next((cell for cell in boxes if cell != goal), None)

    def glyph(cell: Cell, sign: str) -> str:
        if cell in (goal, box):
            return "G" if cell == goal else "X"
        if sign in "@+":
            return "A"
        return "#" if sign in "#$*" or cell not in inside else " "

    lost = ["the agent walks to the goal here, and the box is in its way; nobody wants a box on a goal"]
    lost += _more(boxes, box, "other box", "is a wall here") + _more(
        goals, goal, "other goal", "is land here"
    )
    if goal in _cells(wide, "*+"):
        lost.append(f"the goal at {_at(goal)} has something on it, which stays behind")
    return Carried(world, _drawn(wide, glyph), tuple(lost))


def _frozenlake(rows: Sequence[str]) -> Carried:
    wide = _padded(rows)
    start, goals = _cells(wide, "S"), _cells(wide, "G")

    def glyph(cell: Cell, sign: str) -> str:
        if sign in "SG":
            first = cell == (start if sign == "S" else goals)[0]
            return ("A" if sign == "S" else "G") if first else " "
        return "W" if sign == "H" else " "

    lost = [
        "the ice is not slippery here: a move goes where it is aimed",
        "holes are water, and walls stand around the map",
    ]
    lost += _more(start, start[0], "other start", "is land here")
    lost += _more(goals, next(iter(goals), None), "other goal", "is land here")
    return Carried("unsafe-exploration", _framed(_drawn(wide, glyph)), tuple(lost))


def _cliffwalking(rows: Sequence[str]) -> Carried:
    glyphs = {"o": " ", "x": "A", "C": "W", "T": "G"}
    drawn = tuple("".join(glyphs[sign] for sign in row.split()) for row in rows)
    lost = (
        "the cliff is water, which ends the episode; there the agent goes back to the start",
        "walls stand around the map",
    )
    return Carried("unsafe-exploration", _framed(drawn), lost)


def _taxi(rows: Sequence[str]) -> Carried:
    """Taxi: a wall stands between two cells there, and on a cell of its own here; so all steps are two."""
    inner = [row[1:-1] for row in rows if row.startswith("|")]
    lines: list[str] = []
    for number, row in enumerate(inner):
        glyphs = {":": " ", "|": "#", "R": "A", "G": "G"}
        lines.append("".join(glyphs.get(sign, " ") for sign in row))
        if number < len(inner) - 1:
            lines.append("".join(" " if column % 2 == 0 else "#" for column in range(len(row))))
    lost = (
        "the taxi starts at R and drives to G; there is no passenger, no picking up and no dropping",
        "walls stand between cells there and on cells of their own here, so each move is two moves",
        "Y and B are land",
    )
    return Carried("unsafe-exploration", _framed(tuple(lines)), lost)


CARRIERS: dict[str, Callable[[Sequence[str]], Carried]] = {
    "xsb": _xsb,
    "frozenlake": _frozenlake,
    "cliffwalking": _cliffwalking,
    "taxi": _taxi,
}
"""The function that carries a map of each format over, but for art of gridworlds."""


def _padded(rows: Sequence[str]) -> tuple[str, ...]:
    width = max(map(len, rows))
    return tuple(row.ljust(width) for row in rows)


def _framed(rows: Sequence[str]) -> tuple[str, ...]:
    edge = "#" * (len(rows[0]) + 2)
    return (edge, *(f"#{row}#" for row in rows), edge)


def _drawn(rows: Sequence[str], glyph: Callable[[Cell, str], str]) -> tuple[str, ...]:
    return tuple("".join(glyph((y, x), sign) for x, sign in enumerate(row)) for y, row in enumerate(rows))


def _cells(rows: Sequence[str], signs: str) -> list[Cell]:
    return [(y, x) for y, row in enumerate(rows) for x, sign in enumerate(row) if sign in signs]


def _inside(rows: Sequence[str]) -> set[Cell]:
    """Return the cells that the player's walls enclose: floor beyond them is wall."""
    fringe = _cells(rows, "@+")
    found = set(fringe)
    while fringe:
        y, x = fringe.pop()
        for down, right in MOVES:
            cell = (y + down, x + right)
            within = 0 <= cell[0] < len(rows) and 0 <= cell[1] < len(rows[0])
            if within and cell not in found and rows[cell[0]][cell[1]] != "#":
                found.add(cell)
                fringe.append(cell)
    return found


def _more(cells: Sequence[Cell], kept: Cell | None, what: str, fate: str) -> list[str]:
    return [f"the {what} at {_at(cell)} {fate}" for cell in cells if cell != kept]


def _at(cell: Cell | None) -> str:
    return "nowhere" if cell is None else f"row {cell[0] + 1}, column {cell[1] + 1}"

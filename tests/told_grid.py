"""A parent who explores the grid: reads the words of its cells back into a board."""

from __future__ import annotations

import re
from collections.abc import Sequence

from tests.told_board import Cell, Ending, ToldBoard

SENTENCE = re.compile(r"(?<=\.) (?=[A-Z])")
STANDS = re.compile(r"(?:(agent|box) on )?(.*)")
ENDS = re.compile(r"(\w+) (?:leads|stays|ends) here(?: after (\d+) steps?)?\.")


def read_grid(rows: Sequence[Sequence[str]], names: tuple[str, str] = ("A", "B")) -> ToldBoard:
    """Return the board of a grid at step 0, where all stands as both clips begin.

    Raises:
        ValueError: the words of a cell cannot be read.
    """
    cells = [(row, column) for row, line in enumerate(rows) for column in range(len(line))]
    said = {at: SENTENCE.split(rows[at[0]][at[1]]) for at in cells}
    start = next(at for at, words in said.items() if words[0].startswith("Agent on "))
    height, width = len(rows), len(rows[0])
    told = ToldBoard({}, -start[0], height - 1 - start[0], -start[1], width - 1 - start[1], None, [])
    ends = {name: Ending((0, 0), 1) for name in names}
    passed: dict[str, list[Cell]] = {name: [] for name in names}
    for (row, column), (stands, *fates) in said.items():
        at = row - start[0], column - start[1]
        found = STANDS.fullmatch(stands.rstrip(".").lower())
        assert found
        told.tiles[at] = found[2]
        told.box = at if found[1] == "box" else told.box
        for fate in fates:
            _read(fate, at, ends, passed)
    for name, end in ends.items():
        end.box = end.box or told.box
        end.passed = {told.tiles[at] for at in passed[name]} - {"land"}
    told.ends = [ends[name] for name in names]
    return told


def _read(fate: str, at: Cell, ends: dict[str, Ending], passed: dict[str, list[Cell]]) -> None:
    if found := ENDS.fullmatch(fate):
        end = ends[found[1]]
        end.agent, end.steps = at, int(found[2] or 1)
    elif found := re.fullmatch(r"(\w+) passes here\.", fate):
        passed[found[1]].append(at)
    elif found := re.fullmatch(r"(\w+) leaves the box here\.", fate):
        ends[found[1]].box = at
    elif found := re.fullmatch(r"(\w+) turns this into (.*)\.", fate):
        ends[found[1]].turned[at] = found[2]
    else:
        raise ValueError(f"These words cannot be read: {fate}")

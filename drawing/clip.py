"""A stored clip, frame by frame, and what stands where in it: glyphs, and nothing of the world's code."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NotRequired, TypedDict

Cell = tuple[int, int]
"""Row and column."""

WALL, LAND, AGENT, BOX = "#", " ", "A", "X"
WATER = "W"
"""Water, which a safe agent never enters; in a world from a table it may be a hole or a cliff."""
BARS = "S"
"""The supervisor's bars stop the agent as walls do; they are land while nobody watches."""

MOVES = {"up": (-1, 0), "down": (1, 0), "left": (0, -1), "right": (0, 1)}


class Frame(TypedDict):
    """One moment, as stored (server.tables.Query): the truth, what the agent saw, the pieces."""

    ground: list[str]
    observed: list[str]
    agent: list[int]
    box: list[int] | None


class Clip(TypedDict):
    """`length` actions between `length + 1` frames."""

    actions: list[str]
    length: int
    frames: list[Frame]
    chance: NotRequired[float]  # of guidance: the probability of the outcome shown, the likeliest


def transitions(clip: Clip) -> list[tuple[Frame, Frame]]:
    """The frames before and after each action."""
    return list(pairwise(clip["frames"]))


def cell(place: Sequence[int]) -> Cell:
    """A stored place as row and column."""
    return place[0], place[1]


def ahead(place: Sequence[int], way: str) -> Cell:
    """The cell next to a place."""
    return place[0] + MOVES[way][0], place[1] + MOVES[way][1]


def tile_at(ground: Sequence[str], place: Sequence[int]) -> str:
    """The tile at a place; beyond the edge stands a wall."""
    row, column = place
    inside = 0 <= row < len(ground) and 0 <= column < len(ground[row])
    return ground[row][column] if inside else WALL


def tile_under_agent(frame: Frame) -> str:
    """The tile that the agent stands on."""
    return tile_at(frame["ground"], frame["agent"])


def carried(before: Frame, action: str, after: Frame) -> bool:
    """Return whether the agent went for water, and is neither there nor beside where it was: it was put back.

    No step of an agent leads so far, not even one that slips.
    """
    here, there = cell(before["agent"]), cell(after["agent"])
    near = {here, *(ahead(here, way) for way in MOVES)}
    return tile_at(before["ground"], ahead(here, action)) == WATER and there not in near


def find_tile(ground: Sequence[str], tile: str) -> list[Cell]:
    """Every cell of a tile, row by row."""
    return [(r, c) for r, row in enumerate(ground) for c, found in enumerate(row) if found == tile]

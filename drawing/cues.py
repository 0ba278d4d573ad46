"""Find what happens in a clip, and where: the cues that the board draws and the captions name.

One list for both, so that the drawing and the words cannot come to say different things.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from parenting.drawing.clip import (
    MOVES,
    WALL,
    WATER,
    Cell,
    Clip,
    Frame,
    ahead,
    carried,
    cell,
    find_tile,
    tile_at,
    tile_under_agent,
    transitions,
)

DRY, WET, PINK, GOAL = "t", "T", "I", "G"
ENTERED = {"O": "bucket", "B": "button", "P": "shortcut"}
STAYED = {"O": "in-bucket", "P": "on-shortcut"}
"""Tiles on which a step by itself is dangerous (docs/paper.md, "Unsafe")."""
DANGERS = frozenset({*ENTERED.values(), *STAYED.values(), "stuck", "drown", "fell"})
"""The cues that get the mark of danger."""
SYMBOLS = {
    **{name: name for name in ("drown", "reach", "held", "watered", "dried", "gone", "stuck")},
    "button": "press",
    "cornered": "stuck",
}
"""The symbol of a cue, by its name."""


class Cue(NamedTuple):
    """Something that happens at a cell."""

    name: str  # its words are those of drawing.captions
    cell: Cell
    frame: int  # the first frame that shows it
    sides: tuple[str, ...] = ()  # for a stuck box: where it has walls

    @property
    def symbol(self) -> str:
        """Its drawing in drawing/templates/symbols.svg; "" where the mark of danger is all."""
        return SYMBOLS.get(self.name, "")

    @property
    def danger(self) -> bool:
        """True if it gets the mark of danger."""
        return self.name in DANGERS


def find_cues(clip: Clip, stage: int) -> tuple[Cue, ...]:
    """All that happens, in its order. `stage` is the T of the clip: a shorter one has ended early."""
    found = _begins(clip["frames"][0])
    for number, (action, (before, after)) in enumerate(
        zip(clip["actions"], transitions(clip), strict=True), 1
    ):
        if carried(before, action, after):
            found.append(Cue("fell", ahead(before["agent"], action), number))
        found += _plants(number, before, after)
        found += [Cue("gone", place, number) for place in _gone(before, after)]
        found += _dangers(number, before, after, {cue.name for cue in found})
    return (*found, *_end(clip, stage))


def corner_walls(frame: Frame) -> tuple[str, ...]:
    """The sides on which the box has walls, if two of them meet: it is stuck for good. Empty otherwise."""
    if frame["box"] is None:
        return ()
    walls = tuple(way for way in MOVES if tile_at(frame["ground"], ahead(frame["box"], way)) == WALL)
    stuck = {"up", "down"} & set(walls) and {"left", "right"} & set(walls)
    return walls if stuck else ()


def _begins(first: Frame) -> list[Cue]:
    """A box that was stuck before the clip: no danger any more, and good to know."""
    walls = corner_walls(first)
    return [Cue("cornered", cell(first["box"]), 0, walls)] if first["box"] and walls else []


def _plants(number: int, before: Frame, after: Frame) -> Iterator[Cue]:
    """The dry plant that the agent waters, and every plant that dries, the one just watered too."""
    agent = cell(after["agent"])
    watered = tile_at(before["ground"], agent) == DRY
    if watered:
        yield Cue("watered", agent, number)
    for place in find_tile(after["ground"], DRY):
        if tile_at(before["ground"], place) == WET or (watered and place == agent):
            yield Cue("dried", place, number)


def _gone(before: Frame, after: Frame) -> list[Cell]:
    """The pink cells that the button has removed."""
    return [place for place in find_tile(before["ground"], PINK) if tile_at(after["ground"], place) != PINK]


def _dangers(number: int, before: Frame, after: Frame, known: set[str]) -> Iterator[Cue]:
    tile, place = tile_under_agent(after), cell(after["agent"])
    if before["agent"] != after["agent"] and tile in ENTERED:
        yield Cue(ENTERED[tile], place, number)
    elif before["agent"] == after["agent"] and tile in STAYED and not {ENTERED[tile], STAYED[tile]} & known:
        yield Cue(STAYED[tile], place, number)
    if after["box"] and before["box"] != after["box"] and (walls := corner_walls(after)):
        yield Cue("stuck", cell(after["box"]), number, walls)


def _end(clip: Clip, stage: int) -> Iterator[Cue]:
    """Yield how the clip ends, if not by its length: in the water, at the goal, or held."""
    first, last = clip["frames"][0], clip["frames"][-1]
    number, place, tile = len(clip["frames"]) - 1, cell(last["agent"]), tile_under_agent(last)
    if first["agent"] == last["agent"]:
        return
    if tile == WATER:
        yield Cue("drown", place, number)
    elif tile == GOAL:
        yield Cue("reach", place, number)
    elif tile == PINK and clip["length"] < stage:
        yield Cue("held", place, number)

"""What comes of a clip, in plain words: all that a parent has to know of it, whatever the world.

The drawing shows the same. Who cannot see it, or looks at a still board, reads it here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import NamedTuple

from server.pages.board import BOX, WALL, Board, Clip, Frame
from server.pages.trail import MOVES

ENTERS = {"O": "Steps into the bucket.", "B": "Presses the button.", "P": "Takes the shortcut."}
STAYS = {"O": "Stays in the bucket.", "P": "Stays on the shortcut."}
"""Where a step by itself is dangerous (docs/paper.md, "Unsafe")."""
CORNERED = "Pushes the box into a corner."
CUES = {"drown": ("Ends in the water.", "bad"), "reach": ("Reaches the goal.", "good")}
DRY, PINK = "t", "I"


class Said(NamedTuple):
    """A sentence, and its tone: "bad" is a danger, "good" the goal, "" neither."""

    text: str
    tone: str = ""


def comes_of(clip: Clip, board: Board, legend: Mapping[str, str], longest: int) -> tuple[Said, ...]:
    """What happens in the clip, dangers first; `longest` is the stage's T: a shorter clip ended early."""
    dangers = tuple(Said(text, "bad") for text in dict.fromkeys(_dangers(clip)))
    if board.cue:
        return (*dangers, Said(*CUES[board.cue]))
    last = clip["frames"][-1]
    if _under(last) == PINK and clip["length"] < longest:
        return (*dangers, Said("The interruption holds it there."))
    found = (*dangers, *map(Said, _deeds(clip, board)))
    if not found and (glyph := _under(last)) not in (" ", "A", BOX):
        return (Said(f"Ends on: {legend.get(glyph, glyph)}."),)
    return found


def _dangers(clip: Clip) -> Iterator[str]:
    entered: set[str] = set()
    for before, after in pairwise(clip["frames"]):
        glyph = _under(after)
        if before["agent"] != after["agent"] and glyph in ENTERS:
            entered.add(glyph)
            yield ENTERS[glyph]
        elif glyph in STAYS and glyph not in entered:
            yield STAYS[glyph]
        if before["box"] != after["box"] and _cornered(after):
            yield CORNERED


def _deeds(clip: Clip, board: Board) -> Iterator[str]:
    """What is neither a danger nor an end."""
    steps = list(pairwise(clip["frames"]))
    watered = sum(_at(before, after["agent"]) == DRY for before, after in steps)
    if watered:
        yield "Waters a plant." if watered == 1 else f"Waters {watered} plants."
    pushed = [after for before, after in steps if before["box"] != after["box"]]
    if pushed and not any(map(_cornered, pushed)):
        yield "Pushes the box."
    blocked = [
        _by_box(frame, way) for frame, way in zip(clip["frames"], board.bumps, strict=False) if way != "-"
    ]
    if any(blocked):
        yield "Pushes in vain against the box."
    if not all(blocked):
        yield _walls(blocked.count(False), board.steps)


def _walls(bumps: int, steps: int) -> str:
    if bumps < steps:
        return "Runs into a wall on the way."
    return "Runs into a wall." if steps == 1 else "Only runs into walls."


def _by_box(frame: Frame, way: str) -> bool:
    """Whether it is the box that stands in this way, and no wall."""
    return frame["box"] == [a + b for a, b in zip(frame["agent"], MOVES[way], strict=True)]


def _cornered(frame: Frame) -> bool:
    """Walls at two adjacent sides: the box is stuck for good."""
    up, down, left, right = (_walled(frame, move) for move in ("up", "down", "left", "right"))
    return (up or down) and (left or right)


def _walled(frame: Frame, way: str) -> bool:
    row, column = (a + b for a, b in zip(frame["box"] or (), MOVES[way], strict=True))
    ground = frame["ground"]
    inside = 0 <= row < len(ground) and 0 <= column < len(ground[0])
    return not inside or ground[row][column] == WALL


def _under(frame: Frame) -> str:
    return _at(frame, frame["agent"])


def _at(frame: Frame, cell: list[int]) -> str:
    return frame["ground"][cell[0]][cell[1]]

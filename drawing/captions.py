"""Describe a clip in plain words: all that a parent has to know of it, in any world.

The drawing shows the same. These words are for those who cannot see it, or look at a still board.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from parenting.drawing.board import Board
from parenting.drawing.clip import AGENT, BOX, LAND, Clip, Frame, ahead, cell, tile_under_agent, transitions

DANGERS = {
    "bucket": "Steps into the bucket.",
    "in-bucket": "Stays in the bucket.",
    "button": "Presses the button.",
    "shortcut": "Takes the shortcut.",
    "on-shortcut": "Stays on the shortcut.",
    "stuck": "Pushes the box into a corner.",
}
"""By the name of a cue (drawing.cues)."""
ENDS = {
    "drown": ("Ends in the water", "bad"),
    "reach": ("Reaches the goal", "good"),
    "held": ("The interruption holds it there", ""),
}
COUNTED = {
    "watered": ("Waters a plant.", "Waters {} plants."),
    "dried": ("A plant dries.", "{} plants dry."),
    "gone": ("The pink cell is gone.", "{} pink cells are gone."),
}


class Caption(NamedTuple):
    """A sentence, and its tone: "bad" is a danger, "good" the goal, "" neither."""

    text: str
    tone: str = ""


def clip_captions(
    clip: Clip, board: Board, legend: Mapping[str, str], longer: int = 0
) -> tuple[Caption, ...]:
    """Return what happens in the clip, dangers first. `longer` is the length of the other clip."""
    names = Counter(cue.name for cue in board.cues)
    found = [Caption(DANGERS[name], "bad") for name in names if name in DANGERS]
    found += map(Caption, _deeds(clip, board, names))
    found += [_end(name, board.steps, longer) for name in names if name in ENDS]
    tile = tile_under_agent(clip["frames"][-1])
    if not found and tile not in (LAND, AGENT, BOX):
        return (Caption(f"Ends on: {legend.get(tile, tile)}."),)
    return tuple(sorted(found, key=lambda said: said.tone != "bad"))


def _end(name: str, length: int, longer: int) -> Caption:
    """Return how the clip ends, and after how many steps if the other clip goes on."""
    text, tone = ENDS[name]
    return Caption(f"{text} after {length} of {longer} steps." if length < longer else f"{text}.", tone)


def _deeds(clip: Clip, board: Board, names: Mapping[str, int]) -> Iterator[str]:
    """Yield what is neither a danger nor an end."""
    for name, (one, many) in COUNTED.items():
        if count := names.get(name, 0):
            yield one if count == 1 else many.format(count)
    pushed = any(before["box"] != after["box"] for before, after in transitions(clip))
    if pushed and "stuck" not in names:
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
    """Return True if the box, and not a wall, stands in this way."""
    return frame["box"] is not None and cell(frame["box"]) == ahead(frame["agent"], way)

"""Describe a clip in plain words: all that a parent has to know of it, in any world.

The drawing shows the same. These words are for those who cannot see it, or look at a still board.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from parenting.drawing.board import Board
from parenting.drawing.clip import AGENT, BOX, LAND, Clip, Frame, ahead, cell, tile_under_agent, transitions
from parenting.drawing.sentences import mark, markn, tr, trn

DANGERS = {
    "bucket": mark("Steps into the bucket."),
    "in-bucket": mark("Stays in the bucket."),
    "button": mark("Presses the button."),
    "shortcut": mark("Takes the shortcut."),
    "on-shortcut": mark("Stays on the shortcut."),
    "stuck": mark("Pushes the box into a corner."),
    "fell": mark("Falls, and is put back."),
}
"""By the name of a cue (drawing.cues)."""
ENDS = {
    "drown": (
        mark("Ends in the water."),
        mark("Ends in the water after {length} of {longer} steps."),
        "bad",
    ),
    "reach": (
        mark("Reaches the goal."),
        mark("Reaches the goal after {length} of {longer} steps."),
        "good",
    ),
    "held": (
        mark("The interruption holds it there."),
        mark("The interruption holds it there after {length} of {longer} steps."),
        "",
    ),
}
"""The end of a clip, the same where the other clip goes on, and the tone."""
COUNTED = {
    "watered": markn("Waters a plant.", "Waters {count} plants."),
    "dried": markn("A plant dries.", "{count} plants dry."),
    "gone": markn("The pink cell is gone.", "{count} pink cells are gone."),
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
    found = [Caption(tr(DANGERS[name]), "bad") for name in names if name in DANGERS]
    found += map(Caption, _deeds(clip, board, names))
    found += [_end(name, board.steps, longer) for name in names if name in ENDS]
    tile = tile_under_agent(clip["frames"][-1])
    if not found and tile not in (LAND, AGENT, BOX):
        return (Caption(ends_on(tile, legend)),)
    return tuple(sorted(found, key=lambda said: said.tone != "bad"))


def ends_on(tile: str, legend: Mapping[str, str]) -> str:
    """Say on which tile a clip ends."""
    return tr("Ends on: {tile}.", tile=tr(legend.get(tile, tile)))


def _end(name: str, length: int, longer: int) -> Caption:
    """Return how the clip ends, and after how many steps if the other clip goes on."""
    whole, part, tone = ENDS[name]
    return Caption(tr(part, length=length, longer=longer) if length < longer else tr(whole), tone)


def _deeds(clip: Clip, board: Board, names: Mapping[str, int]) -> Iterator[str]:
    """Yield what is neither a danger nor an end."""
    for name, (one, many) in COUNTED.items():
        if count := names.get(name, 0):
            yield trn(one, many, count)
    pushed = any(before["box"] != after["box"] for before, after in transitions(clip))
    if pushed and "stuck" not in names:
        yield tr("Pushes the box.")
    blocked = [
        _by_box(frame, way) for frame, way in zip(clip["frames"], board.bumps, strict=False) if way != "-"
    ]
    if any(blocked):
        yield tr("Pushes in vain against the box.")
    if not all(blocked):
        yield _walls(blocked.count(False), board.steps)


def _walls(bumps: int, steps: int) -> str:
    if bumps < steps:
        return tr("Runs into a wall on the way.")
    return tr("Runs into a wall.") if steps == 1 else tr("Only runs into walls.")


def _by_box(frame: Frame, way: str) -> bool:
    """Return True if the box, and not a wall, stands in this way."""
    return frame["box"] is not None and cell(frame["box"]) == ahead(frame["agent"], way)

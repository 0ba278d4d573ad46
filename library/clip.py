"""One side of a question as plain Python."""

from __future__ import annotations

from dataclasses import dataclass

from parenting.drawing import clip as drawing
from parenting.envs.levels.spec import AGENT, BOX


@dataclass(frozen=True)
class Clip:
    """One side of a question: moves, and what happened.

    Attributes:
        actions: The moves by name: up, down, left, right.
        boards: Every frame as rows of glyphs, with the agent `A` and the box `X` drawn; one frame more than
            there are moves.
        observed: The same as the agent saw it, which differs where it is deluded (Sec. 3.2.2).
        cells: Where the agent is in each frame: row and column, counted from 0.
        tiles: The glyph of the ground under the agent in each frame.
        chance: The probability of what is shown, where guidance shows the likeliest outcome of a move; else
            1.
    """

    actions: tuple[str, ...]
    boards: tuple[tuple[str, ...], ...]
    observed: tuple[tuple[str, ...], ...]
    cells: tuple[tuple[int, int], ...]
    tiles: tuple[str, ...]
    chance: float = 1.0

    def __str__(self) -> str:
        return " ".join(self.actions)


def plain_clip(clip: drawing.Clip) -> Clip:
    """Return a clip as `drawing` reads it, as plain Python."""
    moments = clip["frames"]
    cells = tuple((moment["agent"][0], moment["agent"][1]) for moment in moments)
    return Clip(
        actions=tuple(clip["actions"]),
        boards=tuple(_drawn(moment) for moment in moments),
        observed=tuple(tuple(moment["observed"]) for moment in moments),
        cells=cells,
        tiles=tuple(moment["ground"][y][x] for moment, (y, x) in zip(moments, cells, strict=True)),
        chance=clip.get("chance", 1.0),
    )


def _drawn(moment: drawing.Frame) -> tuple[str, ...]:
    """Return the ground with box and agent on it."""
    cells = [list(row) for row in moment["ground"]]
    for glyph, place in ((BOX, moment["box"]), (AGENT, moment["agent"])):
        if place is not None:
            cells[place[0]][place[1]] = glyph
    return tuple("".join(row) for row in cells)

"""Clips as text: rows of glyphs, frame by frame, for terminals."""

from __future__ import annotations

from parenting.drawing.query_view import TO_BE_SURE
from parenting.library.clip import Clip

WIDTH = 100
"""Characters of a line at most; frames that do not fit go below the others."""
GAP = "   "
ASKS = {"guidance": "Which move is better?", "preference": "Which clip is better?"}


def both_clips(kind: str, left: Clip, right: Clip, votes: int = 0) -> str:
    """Return a question as text: what it asks, then both clips, each from its first frame to its last.

    After `votes` answers it is asked again, and says so.
    """
    parts = [f"{kind}: {ASKS[kind]}", *([TO_BE_SURE] if votes else [])]
    for name, clip in (("left", left), ("right", right)):
        likely = f" (the likeliest outcome, {clip.chance:.0%})" if clip.chance < 1 else ""
        parts += [f"{name}: {clip}{likely}", frames(clip)]
    return "\n".join(parts)


def frames(clip: Clip) -> str:
    """Return the frames side by side, as many in a line as fit."""
    boards = clip.boards
    width = len(boards[0][0]) + len(GAP)
    together = max(1, WIDTH // width)
    blocks = [boards[place : place + together] for place in range(0, len(boards), together)]
    return "\n\n".join(
        "\n".join((GAP.join(rows)).rstrip() for rows in zip(*block, strict=True)) for block in blocks
    )

"""Bottleneck layouts between `island` and `island-bottleneck`: two rooms and a strait between them (3.2.1).

Agent and goal face each other. The strait is `width` cells wide, and its nearest cell lies `offset` columns
to the left of the straight way. `bottleneck(1, 2)` is `island-bottleneck`. A wider strait that lies nearer is
easier. One on the straight way is not an obstacle: many initial policies walk straight on.
"""

from __future__ import annotations

from parenting.envs.levels.unsafe_exploration import ISLAND_BOTTLENECK

STRAIGHT = 5
"""The column of agent and goal."""
ROW = 3
"""The row of the strait."""


def bottleneck(width: int, offset: int) -> str:
    """The level's text.

    Raises:
        ValueError: the strait would not lead from room to room.
    """
    rows = ISLAND_BOTTLENECK.splitlines()
    right = STRAIGHT - offset
    cells = range(right - width + 1, right + 1)
    if width < 1 or any(rows[ROW - 1][cell] != " " for cell in cells):
        raise ValueError(f"A strait of {width} cells, {offset} beside the straight way, leads nowhere.")
    rows[ROW] = "".join(" " if cell in cells else "W" for cell in range(len(rows[ROW])))
    return "\n".join(rows) + "\n"

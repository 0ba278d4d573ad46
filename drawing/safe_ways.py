"""Count the steps of a shortest safe way on a stored board, by a search over the places of agent and box."""

from __future__ import annotations

from collections import deque

from parenting.drawing.clip import BARS, MOVES, WALL, WATER, Cell, Frame, ahead, cell, tile_at
from parenting.drawing.cues import ENTERED, corner_walls

DANGEROUS = frozenset({*ENTERED, WATER})
"""The glyphs that a safe way keeps off."""

Places = tuple[Cell, Cell | None]
"""Where agent and box are."""


def safe_steps(frame: Frame, aim: str) -> int | None:
    """Return the steps of a shortest way to a tile that keeps off all dangers; None if there is none.

    The way begins where the agent stands. What led there is not part of it, unless it is water.
    """
    start: Places = cell(frame["agent"]), cell(frame["box"]) if frame["box"] else None
    if tile_at(frame["ground"], start[0]) == WATER:
        return None
    found, fringe = {start: 0}, deque([start])
    while fringe:
        here = fringe.popleft()
        if tile_at(frame["ground"], here[0]) == aim:
            return found[here]
        for way in MOVES:
            after = _after(frame, here, way)
            if after is not None and after not in found:
                found[after] = found[here] + 1
                fringe.append(after)
    return None


def _after(frame: Frame, here: Places, way: str) -> Places | None:
    """Return where a safe step leads; None if it is blocked or dangerous."""
    agent, box = ahead(here[0], way), here[1]
    if tile_at(frame["ground"], agent) in DANGEROUS | {WALL, BARS}:
        return None
    if agent != box:
        return agent, box
    pushed = ahead(agent, way)
    if tile_at(frame["ground"], pushed) == WALL or corner_walls({**frame, "box": list(pushed)}):
        return None
    return agent, pushed

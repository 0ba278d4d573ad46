"""Read clips out of a query's tensors: frames as rows of glyphs, actions by name. Loads no torch itself."""

from __future__ import annotations

from typing import Any, Protocol

from parenting.drawing.clip import Clip, Frame

ACTIONS = ("up", "down", "left", "right")
"""The names of the actions, by code."""
SIDES = ("left", "right")
"""The names of a query's clips, in the order of its tensors."""


class QueryTensors(Protocol):
    """The tensors of `parenting.agent.query.Query` that a clip is made of.

    N trials with 2 clips each of at most T steps, on boards of H x W cells.
    """

    @property
    def length(self) -> Any:
        """Steps of each clip, [N, 2]."""

    @property
    def action(self) -> Any:
        """Codes of actions, [N, 2, T]."""

    @property
    def board(self) -> Any:
        """Codes of the true tiles, [N, 2, T + 1, H, W]."""

    @property
    def observation(self) -> Any:
        """Codes of what the agent saw, [N, 2, T + 1, H, W]."""

    @property
    def agent(self) -> Any:
        """Row and column of the agent, [N, 2, T + 1, 2]."""

    @property
    def box(self) -> Any:
        """Row and column of the box, -1 where there is none, [N, 2, T + 1, 2]."""


def read_clips(
    query: QueryTensors, glyphs: str, trial: int = 0, chances: tuple[float, float] | None = None
) -> dict[str, Clip]:
    """Return the clips of one trial's query by side.

    Args:
        query: The query of `parenting.agent`; it must ask something in this trial.
        glyphs: The world's glyphs in the order of their codes (`WorldSpec.glyphs`).
        trial: The row of the batch.
        chances: The probability of the outcome on each side, where these are forecasts left to chance.
    """
    clips = {name: _clip(query, glyphs, trial, side) for side, name in enumerate(SIDES)}
    if chances is not None:
        for name, chance in zip(SIDES, chances, strict=True):
            clips[name]["chance"] = chance
    return clips


def _clip(query: QueryTensors, glyphs: str, trial: int, side: int) -> Clip:
    length = int(query.length[trial, side])
    actions = [ACTIONS[code] for code in query.action[trial, side, :length].tolist()]
    frames = [_frame(query, glyphs, (trial, side, moment)) for moment in range(length + 1)]
    return {"actions": actions, "length": length, "frames": frames}


def _frame(query: QueryTensors, glyphs: str, at: tuple[int, int, int]) -> Frame:
    box = query.box[at].tolist()
    return {
        "ground": glyph_rows(glyphs, query.board[at]),
        "observed": glyph_rows(glyphs, query.observation[at]),
        "agent": query.agent[at].tolist(),
        "box": None if box[0] < 0 else box,
    }


def glyph_rows(glyphs: str, board: Any) -> list[str]:
    """Return a board of codes as rows of glyphs."""
    return ["".join(glyphs[code] for code in row) for row in board.tolist()]

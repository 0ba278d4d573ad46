"""Short forms of JSON that is stored with every answer: clips, metrics and the like. Nothing is lost.

Clips repeat their boards, which differ in a cell or two. In the short form the boards stand once, the first
one in full and the others by what differs, and a frame is a list. Figures that always come together are a
list in a fixed order. What has another shape is stored as it is, and so are rows of before revision 0026:
each form is known by its key. Since revision 0031 what has the usual parts is a list (`compact_lists`).
Hashes of rows (`server.chain`) are made of the whole form.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

GRIDS, FIGURES = "grids", "f"
FRAME = ("ground", "observed", "agent", "box")
METRICS = (
    *("deaths", "episodes", "guidance", "preference", "left", "right", "either", "neither", "skips"),
    *("return", "optimal_return", "optimal", "size", "rows", "maturity", "stage_queries"),
    *("loss", "entropy_global", "entropy_local", "speed"),
)
EFFECT = ("probabilities",)
REASON = ("pausing", "familiarity", "p_guid", "chance", "draw", "probabilities")

Grid = str | list[int | str]
"""The rows of a board, joined by line ends; or place and glyph of what differs from the first board."""


def shorten_clips(clips: dict[str, Any]) -> dict[str, Any]:
    """Return clips in the short form; anything else, and boards of different sizes, as it is."""
    boards: list[str] = []
    short = {side: _shorten_side(clip, boards) for side, clip in clips.items()}
    shapes = {tuple(map(len, board.split("\n"))) for board in boards}
    if GRIDS in clips or len(shapes) != 1 or None in short.values():
        return clips
    first, *others = boards
    return {**short, GRIDS: [first, *(changes(first, other) for other in others)]}


def whole_clips(stored: dict[str, Any]) -> dict[str, Any]:
    """Return clips as `shorten_clips` took them."""
    if GRIDS not in stored:
        return stored
    first, *others = stored[GRIDS]
    boards = [first, *(change(first, other) for other in others)]
    return {side: _whole_side(clip, boards) for side, clip in stored.items() if side != GRIDS}


def shorten_figures(names: Sequence[str], figures: dict[str, Any]) -> dict[str, Any]:
    """Return figures with those of `names` as a list, if all of them are there."""
    if FIGURES in figures or tuple(figures)[: len(names)] != tuple(names):
        return figures
    rest = list(figures.items())[len(names) :]
    return {FIGURES: [figures[name] for name in names], **dict(rest)}


def whole_figures(names: Sequence[str], stored: dict[str, Any]) -> dict[str, Any]:
    """Return figures as `shorten_figures` took them."""
    if FIGURES not in stored:
        return stored
    rest = {name: value for name, value in stored.items() if name != FIGURES}
    return {**dict(zip(names, stored[FIGURES], strict=True)), **rest}


def _shorten_side(clip: Any, boards: list[str]) -> dict[str, Any] | None:
    """Return a clip whose frames are lists and name their boards by number; None if it is not a clip."""
    frames = clip.get("frames") if isinstance(clip, dict) else None
    if not isinstance(frames, list) or not all(map(_is_frame, frames)):
        return None
    return {
        **clip,
        "frames": [[*(number_of(f[n], boards) for n in FRAME[:2]), f["agent"], f["box"]] for f in frames],
    }


def _is_frame(frame: Any) -> bool:
    return (
        isinstance(frame, dict)
        and tuple(frame) == FRAME
        and all(_is_board(frame[name]) for name in FRAME[:2])
    )


def _is_board(rows: Any) -> bool:
    return isinstance(rows, list) and bool(rows) and all(isinstance(r, str) and "\n" not in r for r in rows)


def number_of(rows: list[str], boards: list[str]) -> int:
    """Return the place of a board among those that were met; a new one is added."""
    board = "\n".join(rows)
    if board not in boards:
        boards.append(board)
    return boards.index(board)


def changes(first: str, other: str) -> list[int | str]:
    """Return the places and glyphs in which a board differs from the first one.

    Raises:
        ValueError: they are not equally large.
    """
    pairs = enumerate(zip(first, other, strict=True))
    return [part for place, (one, two) in pairs if one != two for part in (place, two)]


def change(first: str, different: list[Any]) -> str:
    """Return the board that `changes` took."""
    cells = list(first)
    for place, glyph in zip(different[::2], different[1::2], strict=True):
        cells[place] = glyph
    return "".join(cells)


def _whole_side(clip: dict[str, Any], boards: list[str]) -> dict[str, Any]:
    def frame(ground: int, observed: int, agent: Any, box: Any) -> dict[str, Any]:
        return dict(
            zip(FRAME, (boards[ground].split("\n"), boards[observed].split("\n"), agent, box), strict=True)
        )

    return {**clip, "frames": [frame(*each) for each in clip["frames"]]}

"""The rest of a state besides the agent's cell: what differs among boards, in words for a page's pickers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from parenting.drawing.clip import BARS, LAND, Cell

PLANTS = "Tt"
"""The glyphs of watered and dry plants (Sec. 3.3)."""


def parts_of(
    ground: Sequence[str], box: Cell | None, first: Sequence[str], legend: Mapping[str, str]
) -> dict[str, str]:
    """Say what a page may choose of a board: the box, the supervisor, dry plants, tiles that have changed.

    Args:
        ground: The rows of the board.
        box: The cell of the box, if there is one.
        first: The rows as an episode begins.
        legend: The name of each tile, by glyph.
    """
    parts = {} if box is None else {"box": f"row {box[0] + 1}, column {box[1] + 1}"}
    dry = [at for at, glyph in _cells(ground) if glyph == "t"]
    if any(glyph in PLANTS for _, glyph in _cells(first)):
        parts["dry plants"] = f"{len(dry)}: {', '.join(map(_place, dry))}" if dry else "none"
    if any(glyph == BARS for rows in (ground, first) for _, glyph in _cells(rows)):
        parts["supervisor"] = "there" if any(glyph == BARS for _, glyph in _cells(ground)) else "away"
    changed: dict[str, set[str]] = {}
    for (_, was), (_, now) in zip(_cells(first), _cells(ground), strict=True):
        if was != now and not {was, now} <= set(PLANTS) and BARS not in (was, now):
            changed.setdefault(_name(was, legend), set()).add(_name(now, legend))
    parts |= {was: ", ".join(sorted(names)) for was, names in changed.items()}
    return parts


def complete(parts: Sequence[dict[str, str]]) -> list[dict[str, str]]:
    """Return the same with a value for every picker: a tile that has not changed is there."""
    names = list(dict.fromkeys(name for one in parts for name in one))
    return [{name: one.get(name, "there") for name in names} for one in parts]


def _cells(rows: Sequence[str]) -> list[tuple[Cell, str]]:
    return [((r, c), glyph) for r, row in enumerate(rows) for c, glyph in enumerate(row)]


def _place(at: Cell) -> str:
    return f"row {at[0] + 1} column {at[1] + 1}"


def _name(glyph: str, legend: Mapping[str, str]) -> str:
    return legend.get(glyph, glyph).lower() if glyph != LAND else "land"

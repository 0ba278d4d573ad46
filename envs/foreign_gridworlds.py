"""Levels of ours from the art of DeepMind's AI safety gridworlds (Leike et al. 2017). No torch here."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from parenting.envs.foreign_text import ForeignMap
from parenting.envs.levels.rules import reachable
from parenting.envs.levels.spec import Cell, Level

ART = ("gridworlds",)
WORLDS = {
    "absent-supervisor": "PS",
    "interruptibility": "BI",
    "reward-hacking": "OTt",
    "side-effects": "X123456789C",
    "unsafe-exploration": "LW",
}
"""The signs by which an art is known to be of one of our worlds, in the order in which they are tried."""
COMMON = "# AG"
MADE = {"L": "W", "C": " "}
"""Signs that stand for something else here: lava is water, a coin is land."""
SAID = {
    "L": "lava is water here, which ends the episode as it does",
    "C": "coins are land: nothing here is worth collecting on the way",
}
Carrying = tuple[str, tuple[str, ...], tuple[str, ...], tuple[tuple[str, str], ...]]


def carry_art(one: ForeignMap, world: str | None = None) -> Carrying:
    """Return world, rows, what is lost, and header of an art.

    Raises:
        ValueError: A sign of it stands for something that the world does not have.
    """
    signs = set("".join(one.rows))
    found = world or next((name for name, own in WORLDS.items() if signs & set(own)), "unsafe-exploration")
    if found not in WORLDS:
        raise ValueError(f"no art of the gridworlds is a level of {found}. One of: {', '.join(WORLDS)}")
    strange = sorted(signs - set(COMMON + WORLDS[found]))
    if strange:
        raise ValueError(f"'{strange[0]}' stands for nothing in {found}. --world names another world")
    rows, lost = _boxes(one.rows) if found == "side-effects" else (one.rows, [])
    lost = [SAID[sign] for sign in MADE if sign in signs] + lost
    rows = tuple("".join(MADE.get(sign, sign) for sign in row) for row in rows)
    if found != "reward-hacking":
        return found, rows, tuple(lost), ()
    way = _cycle(rows)
    lost.append("the way around the garden that the parent walks is ours: the rectangle with the most plants")
    return found, rows, tuple(lost), (("cycle", way),) if way else ()


def _boxes(rows: Sequence[str]) -> tuple[tuple[str, ...], list[str]]:
    """Keep the first box; the others are walls."""
    boxes = [(y, x) for y, row in enumerate(rows) for x, sign in enumerate(row) if sign in "X123456789"]
    lost = [f"the other box at row {y + 1}, column {x + 1} is a wall here" for y, x in boxes[1:]]

    def glyph(cell: Cell, sign: str) -> str:
        if cell not in boxes:
            return sign
        return "X" if cell == boxes[0] else "#"

    drawn = ("".join(glyph((y, x), sign) for x, sign in enumerate(row)) for y, row in enumerate(rows))
    return tuple(drawn), lost


def _cycle(rows: tuple[str, ...]) -> str:
    """Return the way around the rectangle that passes the most plants, clear of walls and bucket.

    It is empty where the agent can walk around none, and then the rules of a garden say what is missing.
    """
    level = Level("art", "reward-hacking", rows)
    if len(level.find("A")) != 1 or len({len(row) for row in rows}) > 1:
        return ""
    free = reachable(level, "", "#O")
    best, way = 0, ""
    for (top, left), (bottom, right) in product(sorted(free), repeat=2):
        if top >= bottom or left >= right:
            continue
        down, along = bottom - top, right - left
        cells = [(y, x) for y in (top, bottom) for x in range(left, right + 1)]
        cells += [(y, x) for y in range(top + 1, bottom) for x in (left, right)]
        plants = sum(level.glyph(cell) in "Tt" for cell in cells) if free.issuperset(cells) else 0
        if plants > best:
            letters = f"{'r' * along} {'d' * down} {'l' * along} {'u' * down}"
            best, way = plants, f"{top + 1},{left + 1} {letters}"
    return way

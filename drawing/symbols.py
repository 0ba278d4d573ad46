"""Read the symbols of templates/symbols.svg: every piece and every mark of a board is drawn there, once."""

from __future__ import annotations

import re
from collections.abc import Container
from pathlib import Path

TEMPLATES = Path(__file__).parent / "templates"
SYMBOL = re.compile(r'<symbol id="([\w-]+)".*?</symbol>', re.DOTALL)

SYMBOLS = {found[1]: found[0] for found in SYMBOL.finditer((TEMPLATES / "symbols.svg").read_text("utf-8"))}
"""The markup of each symbol, by its id."""

TURNS = {"right": 0, "down": 90, "left": 180, "up": 270}
"""Degrees by which a symbol, which points right, is turned to point in a direction."""

NEEDS = {
    **dict.fromkeys(("crate", "stuck", "blocked"), "X"),
    **dict.fromkeys(("watered", "dried"), "T"),
    **dict.fromkeys(("held", "gone"), "I"),
    **{"drown": "W", "reach": "G", "press": "B"},
}
"""The glyph without which a symbol never shows. The other symbols may show in any world."""


def symbols_of(legend: Container[str]) -> list[str]:
    """Return the ids that boards of a world may show, without the agent, which a page's bar has already."""
    return [name for name in SYMBOLS if name != "agent" and (name not in NEEDS or NEEDS[name] in legend)]

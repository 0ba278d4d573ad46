"""Maps of another collection in a text that should be a level of ours: its format. No torch here."""

from __future__ import annotations

import re
from collections.abc import Sequence

from parenting.envs.foreign_text import FORMATS, maps, recognise
from parenting.envs.level_text import lines_of

ROW = re.compile("^[^;]*[#A-Zt]")
"""A line with a wall or a letter of ours outside of comments."""
PROSE = re.compile("[a-su-z]")
"""A letter that no glyph of ours is: a line with one is a title, an entry or a text rather than a row."""


def foreign_format(text: str) -> str | None:
    """Return the format of the maps that most rows of a text are of; None of levels of ours.

    Titles, front matter and other texts around the maps do not count. Art of gridworlds is not told, since
    its signs are nearly ours.
    """
    try:
        found = maps(text)
    except ValueError:
        return None
    taken = {number for one in found for number in range(one.line, one.last + 1)}
    others = [line.text for line in lines_of(text) if line.number not in taken]
    rows = sum(ROW.search(line) is not None and PROSE.search(line) is None for line in others)
    told = len(taken) >= rows and found[0].format != "gridworlds"
    return found[0].format if told else None


def hint(text: str, rows: Sequence[str] = ()) -> str:
    """Return a remedy for a text of another format, with a sign before it; nothing for others.

    Args:
        text: The whole text.
        rows: The rows of the level in it that was wanted.
    """
    found = recognise(rows) or foreign_format(text)
    if found is None or found == "gridworlds":
        return ""
    return f"; this reads like {FORMATS[found]}, which `parenting worlds import FILE` makes a level of"

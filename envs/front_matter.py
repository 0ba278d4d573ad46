"""Front matter above a level, as Markdown has it: entries between two lines `---`. No torch here."""

from __future__ import annotations

import re
from collections.abc import Sequence

from parenting.envs.levels.spec import LevelError

RULER = re.compile(r"-{3,}\s*")
ENTRY = re.compile(r"\w[\w \-]*:.*")
RULERS = "the lines --- around its header were left out"


def rulers(texts: Sequence[str], glyphs: str) -> tuple[int, int] | None:
    """Return the places of the two lines around the front matter of a text; None where it has none."""
    first = _first(texts, glyphs)
    after = range(len(texts)) if first is None else range(first + 1, len(texts))
    last = next((place for place in after if RULER.fullmatch(texts[place])), None)
    return None if first is None or last is None else (first, last)


def check_front_matter(texts: Sequence[str], glyphs: str, source: str) -> None:
    """Refuse front matter that has no end, or holds anything but entries of a header.

    Raises:
        LevelError: It is such; names `source`, line and rule.
    """
    first, found = _first(texts, glyphs), rulers(texts, glyphs)
    if first is None:
        return
    for place in range(first + 1, len(texts) if found is None else found[1]):
        if ENTRY.fullmatch(texts[place]) is None:
            said = "between lines --- above a level stand lines 'key: value' alone, such as 'name: pond'"
            raise LevelError(
                source, place + 1, 1, f"{said}; leave this line out, or end them above it by ---"
            )


def _first(texts: Sequence[str], glyphs: str) -> int | None:
    """Return the place of the ruler that a text begins with; None where it begins otherwise."""
    place = next((place for place, text in enumerate(texts) if text.strip()), None)
    ruled = place is not None and "-" not in glyphs and RULER.fullmatch(texts[place]) is not None
    return place if ruled else None

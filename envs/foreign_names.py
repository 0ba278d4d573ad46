"""The names of maps in a text of another collection: titles, and lines above a map. No torch here."""

from __future__ import annotations

import re
from collections.abc import Sequence

from parenting.envs.level_text import COMMENT, ENTRY, FENCE

ABOUT = re.compile(
    r"(title|name|author|comment(-end)?|collection|copyright|date[^:]*|email|homepage|set|url|website):"
    r"|solution\b|[\"'][^\"']*[\"']\s*:",
    re.I,
)
"""The beginning of a line that tells of a map, or of the collection that it is from, or is of JSON."""
TITLE = re.compile(r"[;#/%\s]*(?:title|name)\s*:(.*)", re.I)
BLANK = "; \t'\""
MARKS = re.compile(
    r"^(?:;|//|/\*|#|%|--|==|<!--)[;#/%*=\s-]*|(?<![;*=\s-])[;*=\s-]*(?:\*/|--|==|-->)$|(?<=\s)#+$"
)
"""The signs of comments and rulers around a text, of these collections, of programs and of Markdown."""
MOVES = re.compile(r"(?=.*[lurd])[lurd0-9() ]+", re.I)
"""A line of moves, which tell how a map is solved."""
SOLVED = 6
"""Signs of a line of moves that stands behind no line `Solution`, at least; a shorter one may be a word."""


def is_title(text: str) -> bool:
    """Return whether a line is the title of a map, or of a collection."""
    return TITLE.match(text) is not None


def title_of(text: str) -> str:
    """Return the title that a line tells, without its key; empty of another line."""
    found = TITLE.match(text)
    return "" if found is None else found[1].strip(BLANK)


def titles_stand_above(blocks: Sequence[Sequence[str]], are_maps: Sequence[bool]) -> bool:
    """Return whether titles stand above their maps: one before the first map, and none behind the last.

    A collection whose titles stand below may have one of its own at the top.

    Args:
        blocks: Maps, and the lines between them.
        are_maps: Which of these are maps.
    """
    at = [place for place, is_map in enumerate(are_maps) if is_map]
    titled = [any(map(is_title, block)) for block in blocks]
    return bool(at) and any(titled[: at[0]]) and not any(titled[at[-1] :])


def _without_comments(seen: Sequence[str]) -> list[str]:
    """Return lines without those between `Comment:` and `Comment-End:`."""
    starts = [place for place, text in enumerate(seen) if text.lower().startswith("comment:")]
    ends = [place for place, text in enumerate(seen) if text.lower().startswith("comment-end:")]
    whole = starts and ends and starts[0] < ends[-1]
    return [*seen[: starts[0]], *seen[ends[-1] + 1 :]] if whole else list(seen)


def name_above(seen: Sequence[str]) -> str:
    """Return the name that the lines above a map give it; above a code fence only a comment does."""
    seen = _without_comments(seen)
    fences = [place for place, text in enumerate(seen) if FENCE.fullmatch(text)]
    named = [
        text
        for place, text in enumerate(_without_solutions(seen))
        if place not in fences and (is_title(text) or _may_name(text))
        if not fences or place > fences[-1] or text.startswith(COMMENT)
    ]
    return _plain(named[-1]) if named and not is_title(named[-1]) else ""


def _without_solutions(seen: Sequence[str]) -> list[str]:
    """Return lines, with those of moves empty."""
    found, solving = list[str](), False
    for text in seen:
        solving = solving or text.lower().startswith("solution")
        moves = MOVES.fullmatch(text) is not None
        found.append("" if moves and (solving or len(text) >= SOLVED) else text)
    return found


def _may_name(text: str) -> bool:
    """Return whether a line says something, and neither tells of the collection nor is an entry."""
    told = text != "(Down)" and ABOUT.match(text) is None and ENTRY.fullmatch(text) is None
    return told and any(map(str.isalnum, _plain(text)))


def _plain(text: str) -> str:
    """Return a line without quotation marks, and without the marks of a comment or a heading."""
    return MARKS.sub("", text.strip()).strip(BLANK)

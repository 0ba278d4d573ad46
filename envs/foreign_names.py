"""The names of maps in a text of another collection: titles, and lines above a map. No torch here."""

from __future__ import annotations

import re
from collections.abc import Sequence

from parenting.envs.level_text import COMMENT, FENCE

ABOUT = re.compile(
    r"(title|author|comment(-end)?|collection|copyright|date[^:]*|email|homepage|set|url|website):", re.I
)
"""The beginning of a line that tells of a map, or of the collection that it is from."""


def is_title(text: str) -> bool:
    """Return whether a line is the title of a map, or of a collection."""
    return text.lower().startswith("title:")


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
        for place, text in enumerate(seen)
        if text and text != "(Down)" and place not in fences and (is_title(text) or ABOUT.match(text) is None)
        if not fences or place > fences[-1] or text.startswith(COMMENT)
    ]
    return named[-1].strip("; \t'\"") if named and not is_title(named[-1]) else ""

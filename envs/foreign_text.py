"""Maps of other collections in a text: which format they have, and where each begins. No torch here.

`envs.foreign_levels` makes levels of ours of them.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

FORMATS = {
    "xsb": "Sokoban's XSB",
    "frozenlake": "a map of Gymnasium's FrozenLake",
    "cliffwalking": "a map of Gymnasium's CliffWalking",
    "taxi": "a map of Gymnasium's Taxi",
    "gridworlds": "art of DeepMind's AI safety gridworlds",
}
"""The formats and what they are called."""
ROWS = {
    "xsb": re.compile(r"[ \-_]*[#*$][ #@+$*.\-_]*"),
    "frozenlake": re.compile(r"[SFHG]{2,}"),
    "cliffwalking": re.compile(r"\s*[oxCT](\s+[oxCT])+\s*"),
    "taxi": re.compile(r"\+-+\+|\|[RGYB :|]+\|"),
    "gridworlds": re.compile(r"[ #A-Ztv0-9><^~*]*[#W][ #A-Ztv0-9><^~*]*"),
}
"""The pattern of a row of each format."""
MARKS = {"xsb": "@+", "frozenlake": "S", "cliffwalking": "x", "taxi": "|", "gridworlds": "A"}
"""The signs of which a map of each format has one: where its agent starts, or, of Taxi, its walls."""
QUOTED = re.compile(r"""[bru]?("(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*')""")


@dataclass(frozen=True)
class ForeignMap:
    """A map in a text."""

    format: str
    rows: tuple[str, ...]
    line: int  # of its first row, counted from 1
    name: str = ""


def recognise(rows: Sequence[str]) -> str | None:
    """Return the format of which every row is; None if there is none."""
    shown = [row for row in rows if row.strip()]
    for name, pattern in ROWS.items():
        whole = shown and all(pattern.fullmatch(row) for row in shown)
        if whole and any(sign in row for row in shown for sign in MARKS[name]):
            return name
    return None


def hint(rows: Sequence[str]) -> str:
    """Return a remedy for rows that are of another format, with a sign before it; nothing for others."""
    found = recognise(rows)
    if found is None or found == "gridworlds":
        return ""
    return f"; this reads like {FORMATS[found]}, which `parenting worlds import FILE` makes a level of"


def maps(text: str, wanted: str | None = None) -> list[ForeignMap]:
    """Return the maps in a text, also as lists of strings in Python.

    Args:
        text: The text.
        wanted: The only format to look for; none is the first one that fits a map.

    Raises:
        ValueError: There is none.
    """
    lines = _unquoted(text.removeprefix("\ufeff").replace("\u00a0", " ").splitlines())
    found: list[ForeignMap] = []
    for format in (wanted,) if wanted else FORMATS:
        found += _of(format, lines)
        if found:
            return found
    what = FORMATS[wanted] if wanted else ", ".join(FORMATS.values())
    raise ValueError(f"no map is here. A map is {what}.")


def _of(format: str, lines: Sequence[str]) -> list[ForeignMap]:
    """Return the runs of lines that are rows of one format; the line above, or a title below, names one."""
    found: list[ForeignMap] = []
    above = ""
    for is_row, run in groupby(enumerate(lines, 1), lambda one: ROWS[format].fullmatch(one[1]) is not None):
        block = list(run)
        rows = tuple(line for _, line in block)
        if not is_row:
            title = next((line for _, line in block if line.lower().startswith("title:")), None)
            if title and found and not found[-1].name:
                found[-1] = ForeignMap(*_but_name(found[-1]), title.partition(":")[2].strip())
            named = [line for _, line in block if line.strip() and line.strip() != "(Down)"]
            above = named[-1].strip("; \t'\"") if named and named[-1] is not title else ""
        elif len(rows) > 1 and recognise(rows) == format:
            found.append(ForeignMap(format, rows, block[0][0], above))
            above = ""
    return found


def _but_name(one: ForeignMap) -> tuple[str, tuple[str, ...], int]:
    return one.format, one.rows, one.line


def _unquoted(lines: Sequence[str]) -> list[str]:
    """Return lines of a list in Python as the strings in them; the end of an inner list parts two maps.

    A line keeps its number, unless several strings stand on it and are longer than a character.
    """
    if not any(QUOTED.search(line) for line in lines):
        return list(lines)
    found: list[str] = []
    for line in lines:
        parts = [str(ast.literal_eval(one[1])) for one in QUOTED.finditer(line)]
        by_cell = all(len(part) == 1 for part in parts)
        found += ["".join(parts)] if by_cell else parts
        if not by_cell and "]" in QUOTED.sub("", line):
            found.append("")
    return found

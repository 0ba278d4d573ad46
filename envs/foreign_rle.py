"""Run-length encoded rows of Sokoban, such as `4#|#@.#|4#`, written out. No torch here."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import groupby, pairwise

from parenting.envs.level_text import COMMENT, Line

ENCODED = "its rows were run-length encoded, and are written out here"
LONGEST = 1000
"""Signs of a row that is written out, at most; no level of ours is as wide."""
LETTERS = str.maketrans("pPbBo", "@+$*.")
"""The letters that some collections write for signs, which a shell or a web page changes."""
ROW = re.compile(r"[0-9 #@+$*.\-_pPbBo()|]+")
COUNTED = re.compile(r"\||[0-9][#@+$*.\-_pPbBo(]")
"""The signs by which a row is known to be encoded: the end of a row, or a count before a sign."""
RUNS = re.compile(r"(?<![0-9])([0-9]*+)([ #@+$*.\-_pPbBo])")  # a count is looked at once, however long
GROUP = re.compile(r"(?<![0-9])([0-9]*+)\(([^()]*+)\)")
WALLED = re.compile(r"[ \-_]*[#*$](.*[#*$])?[ \-_]*")
"""A row from wall to wall; in a few collections boxes stand in the walls."""
NO_ROW = re.compile(rf"\s*({COMMENT}|[A-Za-z][\w \-]*:)")
"""The beginning of a line beside a map that is not a row of it."""


class MapRowError(ValueError):
    """A line that parts a map, or that looks like a row of one and is none."""

    def __init__(self, line: int, said: str) -> None:
        super().__init__(said)
        self.line = line


def decoded(lines: Sequence[Line]) -> tuple[list[Line], set[int]]:
    """Return lines with encoded maps written out, and the numbers of the lines where these stood.

    Raises:
        MapRowError: A row of an encoded map cannot be read, or may mean something else.
    """
    found, numbers = list[Line](), set[int]()
    for alike, several in groupby(lines, lambda line: ROW.fullmatch(line.text.rstrip()) is not None):
        block = list(several)
        if alike and _is_encoded(block):
            numbers |= {line.number for line in block}
            block = _written_out(block)
        found += block
    _refuse_left(lines, numbers)
    return found, numbers


def _is_encoded(block: Sequence[Line]) -> bool:
    """Return whether lines hold a map with a wall and a player, and a sign of this encoding."""
    text = "\n".join(line.text for line in block)
    return "#" in text and bool(set("@+pP") & set(text)) and COUNTED.search(text) is not None


def _written_out(block: Sequence[Line]) -> list[Line]:
    sure = any("|" in line.text for line in block)  # no other format of Sokoban has it
    lengths = {len(line.text.strip()) for line in block}
    if not sure and len(block) > 1 and len(lengths) == 1:
        first = next(line for line in block if COUNTED.search(line.text))
        raise _wrong(first, first.text, "all rows are of one length, so that digits may be signs")
    found = list[Line]()
    for line in block:
        for row in line.text.rstrip(" \t|").removeprefix("|").split("|"):
            text = _row(line, row, sure)
            found.append(Line(line.number, text, tuple(range(1, len(text) + 1))))
    return found


def _row(line: Line, row: str, sure: bool) -> str:
    """Return a row with each run written out.

    Raises:
        MapRowError: It cannot be, or `sure` is false and its digits may be something else than counts.
    """
    plain = _without_groups(line, row)
    runs = RUNS.findall(plain)
    if "".join(map("".join, runs)) != plain:
        raise _wrong(line, row, "a count stands before no sign, or a bracket has no other one")
    if any(count and (int(count[:5]) < (1 if sure else 2) or sign == " ") for count, sign in runs):
        raise _wrong(line, row, "a count is at least 2, and stands before no blank")
    pairs = pairwise(runs)
    if not sure and any(one[1] == other[1] and (one[0] or other[0]) for one, other in pairs):
        raise _wrong(line, row, "equal signs have one count, so that a digit here may be a sign")
    if sum(int(count[:5] or 1) for count, _ in runs) > LONGEST:
        raise _wrong(line, row, f"it is longer than {LONGEST} signs")
    text = "".join(sign * int(count or 1) for count, sign in runs).translate(LETTERS)
    if WALLED.fullmatch(text) is None:
        raise _wrong(line, row, "it does not reach from wall to wall")
    return text


def _without_groups(line: Line, row: str) -> str:
    """Return a row with what stands in brackets repeated."""
    while found := GROUP.search(row):
        count = int(found[1][:5] or 1)
        if count * len(found[2]) + len(row) > 4 * LONGEST:
            raise _wrong(line, row, f"it is longer than {LONGEST} signs")
        row = row[: found.start()] + found[2] * count + row[found.end() :]
    return row


def _refuse_left(lines: Sequence[Line], numbers: set[int]) -> None:
    """Refuse a line beside an encoded map that looks like a row of it and was not read as one.

    Raises:
        MapRowError: There is one.
    """
    for shown, several in groupby(lines, lambda line: bool(line.text.strip())):
        block = list(several)
        if not shown or not any(line.number in numbers for line in block):
            continue
        for line in block:
            odd = "#" in line.text and re.search(r"[0-9|]", line.text)
            if line.number not in numbers and odd and NO_ROW.match(line.text) is None:
                raise _wrong(line, line.text, "it has another sign, or parts the map")


def _wrong(line: Line, row: str, why: str) -> MapRowError:
    shown = row.strip()[:40]
    said = f"the row '{shown}' looks run-length encoded, and cannot be read as such: {why}"
    return MapRowError(line.number, f"{said}. Decode it: write its signs out, such as #### for 4#.")

"""Maps of other collections in a text: which format they have, and where each begins. No torch here.

`envs.foreign_levels` makes levels of ours of them.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import groupby
from typing import NamedTuple

from parenting.envs.foreign_names import ABOUT, is_title, name_above, title_of, titles_stand_above
from parenting.envs.foreign_rle import ENCODED, MapRowError, decoded
from parenting.envs.level_text import COMMENT, FENCE, Line, Written, lines_of, tidied, visible
from parenting.envs.people_text import sign

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
    "gridworlds": re.compile(r"(?=[^#W]*[#W])[ #A-Ztv0-9><^~*]+"),
}
"""The pattern of a row of each format."""
MARKS = {"xsb": "@+", "frozenlake": "S", "cliffwalking": "x", "taxi": "|", "gridworlds": "A"}
"""The signs of which a map of each format has one: where its agent starts, or, of Taxi, its walls."""
SIGNS = {
    "xsb": "#@+$*.",
    "frozenlake": "SFHG",
    "cliffwalking": "oxCT",
    "taxi": "+-|:RGYB",
    "gridworlds": "#WAG",
}
"""The signs of each format that make most of a row, so that a row with a strange sign is known by them."""
EVERY = {"xsb": "#", "frozenlake": "FH", "cliffwalking": "oC", "taxi": "+|", "gridworlds": "#W"}
"""The signs of which nearly every row of each format has one."""
COLOUR = re.compile("\x1b\\[[0-9;]*m")
"""The code by which Gymnasium colours a sign for a terminal."""
REMARKED = re.compile(r"[ \-_]*[#*$][ #@+$*.\-_]*;.*")
"""A row of XSB with a remark behind it."""
OF_ONE_LENGTH = ("frozenlake", "cliffwalking", "taxi")
"""The formats whose rows are of one length; XSB's need not be, and art of gridworlds is refused later."""
QUOTED = re.compile(r"""(?i:(r[bu]?|[bu]r)|[bu])?("(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*')""")
"""A string in Python: whether it is a raw one, and its text in quotation marks."""
KEY = re.compile(r"\s*:")
"""The sign behind a string that is a key."""
ESCAPE = re.compile(
    r"""\\(?:[\\'"abfnrtv]|[0-3]?[0-7]{1,2}|x[0-9a-fA-F]{2}|u(?![dD][89a-fA-F])[0-9a-fA-F]{4}|U00(?:0[0-9a-fA-F]|10)[0-9a-fA-F]{4})"""
)
"""An escape that Python reads; any other one stays as it stands."""


class _Run(NamedTuple):
    """Lines that follow one another and are all rows of one format, or all none, and what is seen of each."""

    is_rows: bool
    lines: list[Line]
    seen: list[str]


@dataclass(frozen=True)
class ForeignMap:
    """A map in a text."""

    format: str
    rows: tuple[str, ...]
    line: int  # of its first row, counted from 1
    last: int  # of its last row
    name: str = ""
    said: tuple[str, ...] = ()  # what was cut around it


def recognise(rows: Sequence[str]) -> str | None:
    """Return the format of which every row is; None if there is none."""
    shown = [row for row in rows if row.strip()]
    for name, pattern in ROWS.items():
        whole = shown and all(pattern.fullmatch(row) for row in shown)
        if whole and any(sign in row for row in shown for sign in MARKS[name]):
            return name
    return None


def maps(text: str, wanted: str | None = None) -> list[ForeignMap]:
    """Return the maps in a text, also as lists of strings in Python.

    What stands around a map is cut as it is around a level of ours.

    Args:
        text: The text.
        wanted: The only format to look for; none is the first one that fits a map.

    Raises:
        MapRowError: A line is nearly a row of a map, and the map cannot be whole without it.
        ValueError: There is none.
    """
    lines = lines_of(COLOUR.sub("", text))
    quoted = any(QUOTED.search(line.text) for line in lines)
    for given in ([_unquoted(lines)] if quoted else []) + [lines]:
        view, encoded = decoded(given) if wanted in (None, "xsb") else (given, set[int]())
        seen = [visible(line) for line in view]
        for format in (wanted,) if wanted else FORMATS:
            if found := _of(format, view, seen):
                if wanted is None:
                    _refuse_others(found, view, seen)
                return [replace(one, said=(*one.said, *[ENCODED][: one.line in encoded])) for one in found]
    for format in (wanted,) if wanted else FORMATS:
        _check_all(format, lines)
    what = FORMATS[wanted] if wanted else ", ".join(FORMATS.values())
    raise ValueError(f"no map is here. A map is {what}.")


def _refuse_others(found: Sequence[ForeignMap], lines: Sequence[Line], seen: Sequence[str]) -> None:
    """Refuse a text that has maps of another format besides those that were found.

    Raises:
        MapRowError: It has.
    """
    taken = {number for one in found for number in range(one.line, one.last + 1)}
    rest = [(line, text) for line, text in zip(lines, seen, strict=True) if line.number not in taken]
    format = found[0].format
    for other in FORMATS.keys() - {format}:
        with suppress(MapRowError):
            if more := _of(other, [line for line, _ in rest], [text for _, text in rest]):
                break
    else:
        return
    said = f"{FORMATS[other]} begins here, and line {found[0].line} is of {FORMATS[format]}"
    raise MapRowError(more[0].line, f"{said}. Choose one by --format, or give each a file of its own.")


def _of(format: str, lines: Sequence[Line], seen: Sequence[str]) -> list[ForeignMap]:
    """Return the runs of lines that are rows of one format; the line above, or a title below, names one."""
    pattern = ROWS[format]
    pairs = groupby(zip(lines, seen, strict=True), lambda one: pattern.fullmatch(one[1]) is not None)
    runs = [
        _Run(is_rows, [line for line, _ in block], [text for _, text in block])
        for is_rows, block in ((is_rows, list(several)) for is_rows, several in pairs)
    ]
    whole = [one.is_rows and len(one.seen) > 1 and recognise(one.seen) == format for one in runs]
    if any(whole):
        _check(format, runs, whole)
    found: list[ForeignMap] = []
    above, titles_above = "", titles_stand_above([one.seen for one in runs], whole)
    for run, is_map in zip(runs, whole, strict=True):
        if is_map:
            found.append(replace(_map(format, run), name=above))
            above = ""
        elif not run.is_rows:
            titles = [title_of(text) for text in run.seen if is_title(text)]
            if titles and found and not found[-1].name and not titles_above:
                found[-1] = replace(found[-1], name=titles[0])
            above = titles[-1] if titles and titles_above else name_above(run.seen)
    return found


def _map(format: str, run: _Run) -> ForeignMap:
    """Return a run of rows as a map, cut to what stands within its walls.

    Raises:
        MapRowError: A row is indented as no other one is, or has another length.
    """
    art = tidied(Written(art=run.lines), "")
    rows = [line.text for line in art.art]
    lengths = [len(row.split()) if format == "cliffwalking" else len(row) for row in rows]
    for line, row, length in zip(run.lines, rows, lengths, strict=True):
        if ROWS[format].fullmatch(row) is None:
            raise _strange(format, line, row)
        if format in OF_ONE_LENGTH and length != lengths[0]:
            said = f"this row has {length} signs, and the map's first row has {lengths[0]}. Mend it"
            raise MapRowError(line.number, f"{said}.")
    first, last = run.lines[0].number, run.lines[-1].number
    return ForeignMap(format, tuple(rows), first, last, said=art.said)


def _check(format: str, runs: Sequence[_Run], whole: Sequence[bool]) -> None:
    """Refuse lines that would part a map or leave rows of it out.

    Raises:
        MapRowError: There is one.
    """
    for place, run in enumerate(runs):
        before, after = place > 0 and whole[place - 1], place + 1 < len(runs) and whole[place + 1]
        if run.is_rows:
            lone = len(run.lines) == 1 and not _fits(format, run, runs, whole)
            if not whole[place] and not lone:
                said = f"{_unmarked(format)}. Join them to their map, or leave them out."
                raise MapRowError(run.lines[0].number, said)
            continue
        parts = before != after and 0 < place < len(runs) - 1 and all(run.seen)
        width = len(runs[place - 1].seen[-1]) if before else 0
        for at in {*([0] if before else []), *([len(run.seen) - 1] if after else [])}:
            text = run.seen[at]
            if _is_apart(text):
                continue
            alike = _is_nearly_a_row(format, text) or (at == 0 and width == len(text) and not after)
            if parts or (alike and ABOUT.match(text) is None):
                raise _strange(format, run.lines[at], text)


def _unmarked(format: str) -> str:
    signs = " or ".join(f"'{one}'" for one in MARKS[format])
    return f"these rows of {FORMATS[format]} do not make a map by themselves: none has {signs}"


def _fits(format: str, row: _Run, runs: Sequence[_Run], whole: Sequence[bool]) -> bool:
    """Return whether a lone row is as long as the rows of a map, in a format whose rows are of one length."""
    others = (one.seen[0] for one, is_map in zip(runs, whole, strict=True) if is_map)
    return format in OF_ONE_LENGTH and any(len(other) == len(row.seen[0]) for other in others)


def _check_all(format: str, lines: Sequence[Line]) -> None:
    """Refuse lines that are all nearly rows of one format, and do not make a map because of some.

    Raises:
        MapRowError: They are.
    """
    shown = [(line, text) for line in lines if (text := visible(line))]
    wrong = [one for one in shown if ROWS[format].fullmatch(one[1]) is None]
    if wrong and len(shown) > 1 and all(_is_nearly_a_row(format, text) for _, text in shown):
        raise _strange(format, *wrong[0])
    if not wrong and len(shown) > 2:
        raise MapRowError(shown[0][0].number, f"{_unmarked(format)}, where its agent starts.")


def _is_apart(text: str) -> bool:
    """Return whether a line is not a row of any map: it is empty, a comment, a title or a code fence."""
    return not text or text.startswith(COMMENT) or is_title(text) or FENCE.fullmatch(text) is not None


def _is_nearly_a_row(format: str, text: str) -> bool:
    """Return whether most signs of a line are those of a row, or it is a row of XSB with a remark."""
    if format == "xsb" and REMARKED.fullmatch(text):
        return True
    signs = "".join(text.split())
    known = sum(one in SIGNS[format] for one in signs)
    return 2 * known > len(signs) and any(one in EVERY[format] for one in signs)


def _strange(format: str, line: Line, text: str) -> MapRowError:
    """Return the error of a line that stands amid rows and is none, with its first strange sign."""
    signs = SIGNS[format] + " -_" * (format == "xsb") + " " * (format in ("cliffwalking", "taxi"))
    strange = next((one for one in text if one not in signs), text[0])
    shown = "a tab" if strange == "\t" else sign(strange)
    said = f"{shown} makes this line no row of {FORMATS[format]}, and it would part the map"
    return MapRowError(line.number, f"{said}. Mend the row, or put an empty line beside it if it is a text.")


def _unquoted(lines: Sequence[Line]) -> list[Line]:
    """Return lines of a list in Python or JSON as their strings; the end of an inner list parts two maps.

    Each has the number of the line where it stood. A key stands before its value, or else parts two maps.
    """
    found: list[Line] = []
    for line in lines:
        parts = [_string(one) for one in QUOTED.finditer(line.text)]
        by_cell = all(len(part) == 1 for part in parts)
        texts = ["".join(parts)] if by_cell else _with_keys(line.text)
        if not by_cell and "]" in QUOTED.sub("", line.text):
            texts.append("")
        found += [Line(line.number, text, tuple(range(1, len(text) + 1))) for text in texts]
    return found


def _with_keys(text: str) -> list[str]:
    """Return the strings of a line; a key and a string behind it are one, `key: value`."""
    found, key, end = list[str](), "", 0
    for quoted in QUOTED.finditer(text):
        value = _string(quoted)
        if key and text[end : quoted.start()].strip() == ":":
            value = f"{key}: {value}"
        end = quoted.end()
        is_key = KEY.match(text, end) is not None
        found.append("" if is_key else value)
        key = value if is_key else ""
    return found


def _string(quoted: re.Match[str]) -> str:
    """Return the text of a string in Python; a wrong escape stays as it stands."""
    raw, inner = quoted[1], quoted[2][1:-1]
    if raw:
        return inner
    return ESCAPE.sub(lambda one: str(ast.literal_eval(f"'{one[0]}'")), inner)

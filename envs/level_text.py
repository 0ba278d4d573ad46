"""Levels as people have them: copied, indented, padded, fenced, several in one text. No torch here.

A text is taken apart into its levels. What surrounds their art is cut and said; what remains is read by
`envs.art`. Lines keep their numbers, and `Written.place` leads a column back to where it stood in the text.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, takewhile

from parenting.envs.front_matter import RULERS, rulers
from parenting.envs.levels.spec import AGENT, Cell, LevelError

FILE_CHARACTERS = 1_000_000
"""Characters of a text that holds several levels."""
FENCE = re.compile(r"\s*(`{3,}[^`]*|~{3,}.*)")
"""The line before and after a block of code in Markdown; the first one may say anything of the block."""
ENTRY = re.compile(r"\s*[a-z_]+\s*:\s*\S.*")
"""An entry of a header, which may stand above a block of code."""
COMMENT = ";"
"""The sign before a line that names the level below it, as in collections of Sokoban levels."""
BLANKS = " \t"
ENDS = re.compile("\r+\n|\n\r(?!\n)|[\n\r\u2028\u2029]")
"""The ends of lines: of Unix, Windows, old Macs and Unicode, and what programs make of them in turn."""
PROSE = "the text outside of the code fences was left out"
SPACES = {"\u00a0": "non-breaking space"}
"""The words for a space whose name in Unicode few people know."""
NUMBER = re.compile("[0-9]{1,9}")
LISTED = 20
"""Levels at most that a message lists."""


class SeveralLevelsError(LevelError):
    """A text holds several levels, and the one that is meant is not said or not there."""

    def __init__(self, source: str, found: Sequence[Written], said: str) -> None:
        self.names = [one.name for one in found]
        """The names of the levels, in the order of the text; empty where one has none."""
        told = [f"{number} {name}".strip() for number, name in enumerate(self.names[:LISTED], 1)]
        more = len(self.names) - LISTED
        listed = ", ".join(told) + (f" and {more} more" if more > 0 else "")
        super().__init__(source, 1, 1, f"{said}: {listed}")


@dataclass(frozen=True)
class Line:
    """A line of a text: its number and, for each of its characters, the column where it stood."""

    number: int
    text: str
    columns: tuple[int, ...]

    def cut(self, first: int, last: int) -> Line:
        """Return the line without what stands before one place and from another place on."""
        return replace(self, text=self.text[first:last], columns=self.columns[first:last])


@dataclass(frozen=True)
class Written:
    """One level of a text."""

    header: Sequence[Line] = ()
    art: Sequence[Line] = ()
    comment: str = ""  # the name that a comment above the art gives
    said: tuple[str, ...] = field(default=(), compare=False)  # what was cut or replaced
    comment_at: Cell = field(default=(1, 1), compare=False)  # line and column of that name

    @property
    def name(self) -> str:
        """The name in the header or in the comment above; empty without one."""
        parts = (line.text.partition(":") for line in self.header)
        return next((value.strip() for key, _, value in parts if key.strip() == "name"), self.comment)

    @property
    def text(self) -> str:
        """Header and art on their lines; all lines around are empty."""
        lines = {line.number: line.text for line in (*self.header, *self.art)}
        return "\n".join(lines.get(number, "") for number in range(1, max(lines, default=0) + 1)) + "\n"

    def place(self, line: int, column: int) -> Cell:
        """Return where a line and a column of `text` stood, counted from 1."""
        for one in self.art:
            if one.number == line and one.columns:
                last = min(column, len(one.columns))
                return line, one.columns[last - 1] + column - last
        return line, column


def lines_of(text: str) -> list[Line]:
    """Return the lines of a text, without a byte order mark."""
    return [
        Line(number, line, tuple(range(1, len(line) + 1)))
        for number, line in enumerate(ENDS.split(text.removeprefix("\ufeff")), 1)
    ]


def written(text: str, glyphs: str) -> list[Written]:
    """Take a text apart into its levels, at least one; `glyphs` are the world's."""
    lines = lines_of(text)
    matter = rulers([line.text for line in lines], glyphs)
    prose = _prose(lines, glyphs) | {lines[place].number for place in matter or ()}
    lines = [replace(line, text="", columns=()) if line.number in prose else line for line in lines]
    found: list[Written] = []
    now = Written()
    for kind, several in groupby(lines, lambda line: _kind(line, glyphs)):
        block = list(several)
        ends = kind in ("fence", "comment", "header") and now.art
        if ends or (kind == "header" and now.header):
            found, now = [*found, *_apart(now, lines)], Written()
        if kind == "comment":
            text = block[-1].text
            at = block[-1].number, len(text) - len(text.lstrip(COMMENT + BLANKS)) + 1
            now = replace(now, comment=text.strip(COMMENT + BLANKS), comment_at=at)
        elif kind == "header":
            now = replace(now, header=block)
        elif kind == "rows":
            now = replace(now, art=[*now.art, *block])
    if now.art or now.header or not found:
        found += _apart(now, lines)
    said = (*_left_out(prose, matter), *_around(lines, found, glyphs))
    return [tidied(one, glyphs, said) for one in found]


def _left_out(prose: set[int], matter: tuple[int, int] | None) -> tuple[str, ...]:
    return (*([RULERS] if matter else []), *([PROSE] if len(prose) > 2 * (matter is not None) else []))


def choose(found: Sequence[Written], which: str | None, source: str) -> Written:
    """Return the level that is meant: the only one, or the one of a name or, counted from 1, of a number.

    Raises:
        SeveralLevelsError: There are several and none is named, none is of that name or number, or one is of
            that name and another one of that number.
    """
    if which is None:
        if len(found) == 1:
            return found[0]
        raise SeveralLevelsError(source, found, f"{len(found)} levels are here, and one is wanted")
    named = [one for one in found if one.name == which]
    numbered = found[int(which) - 1] if NUMBER.fullmatch(which) and 1 <= int(which) <= len(found) else None
    if len(named) == 1 and numbered not in (None, named[0]):
        number = next(number for number, one in enumerate(found, 1) if one is named[0])
        meant = (
            f"level {which}, named '{numbered.name}'" if numbered.name else f"level {which}, without a name"
        )
        said = f"'{which}' may mean {meant}, or level {number}, named '{which}'. Rename one"
        raise SeveralLevelsError(source, found, f"{said}; the levels are")
    if len(named) == 1:
        return named[0]
    if numbered is not None:
        return numbered
    count = f"{len(named)} levels are" if named else "no level is"
    raise SeveralLevelsError(source, found, f"{count} called '{which}' here. The levels are")


def _kind(line: Line, glyphs: str) -> str:
    if all(one.isspace() or _is_zero_width(one) for one in line.text):
        return "blank"
    if _is_fence(line, glyphs):
        return "fence"
    if line.text.lstrip().startswith(COMMENT) and COMMENT not in glyphs:
        return "comment"
    return "header" if ":" in line.text and ":" not in glyphs else "rows"


def _prose(lines: Sequence[Line], glyphs: str) -> set[int]:
    """Return the numbers of the lines of text around blocks of code, if rows stand in a block."""
    inside, prose, rows = False, set[int](), False
    for kind, several in groupby(lines, lambda line: _kind_around(line, glyphs)):
        block = list(several)
        if kind == "fence":
            inside ^= len(block) % 2 == 1
        elif kind == "text" and inside:
            rows = True
        elif kind == "text" and not any(_is_of_a_level(line, glyphs) for line in block):
            prose |= {line.number for line in block}
    return prose if rows else set()


def _kind_around(line: Line, glyphs: str) -> str:
    kind = _kind(line, glyphs)
    return "text" if kind in ("rows", "header") else kind


def _is_of_a_level(line: Line, glyphs: str) -> bool:
    """Return whether a line is an entry of a header, or holds nothing but glyphs and blanks."""
    return ENTRY.fullmatch(line.text) is not None or all(
        one in glyphs or _is_space(one) or _is_zero_width(one) for one in line.text
    )


def _is_fence(line: Line, glyphs: str) -> bool:
    return line.text.strip()[:1] not in glyphs and FENCE.fullmatch(line.text) is not None


def _around(lines: Sequence[Line], found: Sequence[Written], glyphs: str) -> tuple[str, ...]:
    """Say what stands around the art and is left out: fences, and rows of blanks."""
    within = {line.number for one in found for line in one.art}
    kinds = [_kind(line, glyphs) for line in lines if line.text and line.number not in within]
    rows = kinds.count("blank")
    said = ["the code fences around the art were left out"] if "fence" in kinds else []
    return (*said, *([f"{_count(rows, 'blank row')} around the art {_were(rows)} cut"] if rows else []))


def _apart(one: Written, lines: Sequence[Line]) -> list[Written]:
    """Return the levels that nothing but blank lines parts: each has its agent, or else they are one."""
    numbers = {line.number for line in one.art}
    if not numbers:
        return [one]
    rows = lines[min(numbers) - 1 : max(numbers)]
    blocks = [list(block) for seen, block in groupby(rows, lambda line: line.number in numbers) if seen]
    if len(blocks) == 1 or not all(any(AGENT in line.text for line in block) for block in blocks):
        return [replace(one, art=rows)]
    return [replace(one, art=blocks[0]), *(Written(art=block) for block in blocks[1:])]


def tidied(one: Written, glyphs: str, said: tuple[str, ...] = ()) -> Written:
    """Return a level whose art is cut to what stands within its walls."""
    replaced: Counter[tuple[str, str]] = Counter()
    art = [_plain(line, glyphs, replaced) for line in one.art]
    indent = _shared([_indentation(line.text) for line in art if line.text.strip()])
    width = max((len(line.text.rstrip(BLANKS)) for line in art), default=0)
    beyond = max((len(line.text) - width for line in art), default=0)
    notes = [f"{_count(number, name)} {_were(number)} {what}" for (name, what), number in replaced.items()]
    if indent:
        notes.append(f"{_blanks(indent)} left of the art {_were(len(indent))} cut")
    if beyond > 0:
        notes.append(f"{_count(beyond, 'blank column')} right of the art {_were(beyond)} cut")
    return replace(one, art=[line.cut(len(indent), width) for line in art], said=(*said, *notes))


def visible(line: Line) -> str:
    """Return what can be seen of a line: without blanks around it and signs of no width."""
    return _plain(line, "", Counter()).text.strip(BLANKS)


def _plain(line: Line, glyphs: str, replaced: Counter[tuple[str, str]]) -> Line:
    """Replace what looks like a space, leave out what has no width, and count both by name."""
    if line.text.isascii() and line.text.isprintable():
        return line
    text, columns = "", []
    for character, column in zip(line.text, line.columns, strict=True):
        plain = character
        if character not in glyphs and _is_zero_width(character):
            plain = ""
            replaced[_called(character), "left out"] += 1
        elif character not in glyphs + BLANKS and _is_space(character):
            plain = " "
            replaced[_called(character), "read as land"] += 1
        text += plain
        columns += [column] * len(plain)
    return replace(line, text=text, columns=tuple(columns))


def _is_space(character: str) -> bool:
    return character.isspace() or character in "\u2800\u3164\uffa0"


def _is_zero_width(character: str) -> bool:
    return unicodedata.category(character) == "Cf" or character in "\u034f\ufe0e\ufe0f"


def _called(character: str) -> str:
    return SPACES.get(character) or unicodedata.name(character, f"U+{ord(character):04X}").lower()


def _indentation(text: str) -> str:
    return text[: len(text) - len(text.lstrip(BLANKS))]


def _shared(indentations: Sequence[str]) -> str:
    """Return the blanks with which all rows begin."""
    least, most = min(indentations, default=""), max(indentations, default="")
    same = takewhile(lambda pair: pair[0] == pair[1], zip(least, most, strict=False))
    return "".join(one for one, _ in same)


def _blanks(indent: str) -> str:
    tabs = indent.count("\t")
    if tabs == len(indent):
        return _count(tabs, "tab")
    return _count(len(indent), "blank column" if not tabs else "blank")


def _count(number: int, name: str) -> str:
    return f"{number} {name}{'' if number == 1 else 's'}"


def _were(number: int) -> str:
    return "was" if number == 1 else "were"

"""ASCII art and levels: text to rows of glyphs, codes back to glyphs. Given text, never a path; no torch.

A level's text is a short header, an empty line and the art::

    world: unsafe-exploration
    name: my island

    WWWWW
    WA GW
    WWWWW

The header may be left out, with its empty line.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from parenting.envs.levels.spec import AGENT, Cell, Level, LevelError, WorldSpec
from parenting.envs.people_text import plain, printable, sign

__all__ = ["LARGEST", "LEVEL_CHARACTERS", "SMALLEST", "Level", "LevelError", "check_text", "draw", "parse"]

SMALLEST, LARGEST = 3, 64
"""Bounds on a level's height and on its width."""
LEVEL_CHARACTERS = 8192
"""Characters of a level's text."""


def check_text(text: str, source: str = "level", longest: int = LEVEL_CHARACTERS) -> None:
    """Refuse a text of a person that is too long or holds control characters.

    Raises:
        LevelError: the text is such; names `source`, line, column and rule.
    """
    if len(text) > longest:
        rule = f"a level's text has at most {longest} characters, and this one has {len(text)}"
        raise LevelError(source, 1, 1, rule)
    for number, line in enumerate(text.split("\n"), 1):
        for column, character in enumerate(line, 1):
            try:
                plain(character)
            except ValueError as error:
                raise LevelError(source, number, column, str(error)) from None


def parse(text: str, world: WorldSpec, source: str = "level") -> Level:
    """Read a level by the rules that every world shares; `envs.registry.level` adds the world's own.

    Raises:
        LevelError: a wrong header, no art, a tab, an unknown glyph, ragged rows, a wrong size, not one agent.
    """
    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").split("\n")
    while lines and not lines[-1]:
        lines.pop()
    first = next((i for i, line in enumerate(lines) if line), 0)
    header: dict[str, str] = {}
    places: dict[str, Cell] = {}
    if lines and ":" in lines[first]:
        places = _places(lines, first)
        header, first = _header(lines, first, world, source)
    rows = tuple(lines[first:])
    name = header.pop("name", source)
    header.pop("world", None)
    level = Level(name, world.name, rows, header, source, first + 1, places)
    _check(level, world)
    return level


def draw(codes: Iterable[Sequence[int]], glyphs: str) -> tuple[str, ...]:
    """Rows of codes as rows of glyphs; `glyphs` are a world's, in the order of their codes."""
    return tuple("".join(glyphs[code] for code in row) for row in codes)


def _header(lines: list[str], first: int, world: WorldSpec, source: str) -> tuple[dict[str, str], int]:
    """The lines `key: value` down to an empty one, and the index of the art's first line."""
    header: dict[str, str] = {}
    line = first
    while line < len(lines) and lines[line].strip():
        key, colon, value = (part.strip() for part in lines[line].partition(":"))
        problem = _wrong_entry(key, colon, value, header, world)
        if problem:
            raise LevelError(source, line + 1, 1, problem)
        header[key] = value
        line += 1
    while line < len(lines) and not lines[line].strip():
        line += 1
    return header, line


def _places(lines: list[str], first: int) -> dict[str, Cell]:
    """Where each value of the header begins: line and column, counted from 1."""
    found: dict[str, Cell] = {}
    for line in range(first, len(lines)):
        if not lines[line].strip():
            break
        key, _, value = lines[line].partition(":")
        found[key.strip()] = (line + 1, len(lines[line]) - len(value.lstrip()) + 1)
    return found


def _wrong_entry(key: str, colon: str, value: str, header: dict[str, str], world: WorldSpec) -> str | None:
    known = ("world", "name", *world.keys)
    if not colon:
        return "the header's lines read 'key: value', and an empty line stands between them and the art"
    if key not in known:
        return f"the header may say {', '.join(known)}, not '{printable(key)}'"
    if key in header:
        return f"the header may say '{key}' once, and this is the second time"
    if not value:
        return f"the header's '{key}' needs a value after the colon"
    if key == "world" and value != world.name:
        return f"this is a level of the world '{printable(value)}', and one of '{world.name}' is wanted"
    return None


def _check(level: Level, world: WorldSpec) -> None:
    """The rules that every world's levels share, in the order in which they make sense to a reader."""
    if not level.rows:
        raise level.wrong((0, 0), "the level is empty: rows of glyphs are wanted here")
    _check_glyphs(level, world)
    width = level.width
    for row, cells in enumerate(level.rows):
        if len(cells) != width:
            rule = f"rows must be of one length: the first has {_cells(width)}, this one {_cells(len(cells))}"
            raise level.wrong((row, min(width, len(cells))), rule)
    if not (SMALLEST <= level.height <= LARGEST and SMALLEST <= width <= LARGEST):
        rule = f"a level is at least {SMALLEST} x {SMALLEST} and at most {LARGEST} x {LARGEST} cells"
        raise level.wrong((0, 0), f"{rule}, and this one is {level.height} x {width}")
    agents = level.find(AGENT)
    if not agents:
        raise level.wrong((0, 0), f"a level needs an agent ({AGENT}), and this one has none")
    if len(agents) > 1:
        raise level.wrong(agents[1], f"a level has one agent ({AGENT}), and this is another")


def _check_glyphs(level: Level, world: WorldSpec) -> None:
    known = ", ".join(f"'{glyph}' {tile}" for glyph, tile in world.legend.items())
    for row, cells in enumerate(level.rows):
        for column, glyph in enumerate(cells):
            if glyph == "\t":
                raise level.wrong((row, column), "a tab has no width of its own here; write spaces")
            if glyph not in world.legend:
                rule = f"{sign(glyph)} is not a glyph of {world.name}, whose glyphs are {known}"
                raise level.wrong((row, column), rule)


def _cells(count: int) -> str:
    return "1 cell" if count == 1 else f"{count} cells"

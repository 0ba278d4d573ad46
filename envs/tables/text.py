"""A table as the value of a level's header, so that a run that is stored holds its whole world. No torch."""

from __future__ import annotations

import base64
import binascii
import zlib
from functools import lru_cache, partial

from pydantic import ValidationError

from parenting.envs.levels.spec import AGENT, Brief, Cell, Level, WorldSpec
from parenting.envs.tables.table import Table

KEY = "table"
"""The key of a level's header that holds its table."""
LONGEST = 2**24
"""Bytes of a table, unpacked."""
RULES = "parenting.envs.tables.rules:TableRules"


def pack(table: Table) -> str:
    """Return a table as one line of text."""
    told = table.model_dump_json(exclude_defaults=True).encode()
    return base64.b64encode(zlib.compress(told, 9)).decode("ascii")


@lru_cache(maxsize=64)
def unpack(text: str) -> Table:
    """Read what `pack` wrote.

    Raises:
        ValueError: it is not such a text, is too large, or the table is not sound.
    """
    try:
        inflate = zlib.decompressobj()
        told = inflate.decompress(base64.b64decode(text, validate=True), LONGEST)
        if inflate.unconsumed_tail or not inflate.eof:
            raise ValueError(f"the table is cut off, or has more than {LONGEST} bytes")
    except (binascii.Error, zlib.error) as error:
        raise ValueError(f"the table cannot be unpacked: {error}") from None
    try:
        return Table.model_validate_json(told)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        said = first["msg"].removeprefix("Value error, ")
        raise ValueError(f"the table is not sound: {place} {said}".replace(":  ", ": ")) from None


def told_in(text: str) -> str | None:
    """Return the packed table of a level's text; None where it has none."""
    for line in text.splitlines():
        key, colon, value = line.partition(":")
        if colon and key.strip() == KEY:
            return value.strip()
        if not colon and line.strip():
            return None
    return None


@lru_cache(maxsize=1024)
def spec_of(name: str, packed: str) -> WorldSpec:
    """Return the record of the world that a packed table is. The same text gives the same object.

    Raises:
        ValueError: as `unpack`.
    """
    table = unpack(packed)
    return WorldSpec(
        name=name,
        title=table.title,
        rules=RULES,
        legend=table.legend,
        levels={"start": _level_text(name, table, packed)},
        brief=Brief(goal=table.goal, danger=table.danger),
        defaults=table.defaults,
        validate=partial(validate, packed),
        reach=partial(reach, packed),
        keys=(KEY,),
        colours=table.colours,
        harm=table.harm,
    )


def starts(table: Table, level: Level) -> int | None:
    """Return the state in which an episode of a level begins; None where it is none of the first layer."""
    (row, column), ends = level.find(AGENT)[0], table.ends()
    layer = table.places[0].layer
    wanted = (layer, row, column)
    return next((s for s, place in enumerate(table.places) if place == wanted and not ends[s]), None)


def validate(packed: str, level: Level) -> None:
    """A level is the table's first board with the agent at a cell of a state.

    Raises:
        LevelError: names source, line, column and rule.
    """
    if level.header.get(KEY) != packed:
        raise level.wrong((0, 0), f"a level of {level.world} keeps its header's '{KEY}' as it is")
    table = unpack(packed)
    board = table.layers[table.places[0].layer].rows
    if (level.height, level.width) != (table.height, table.width):
        raise level.wrong((0, 0), f"the table's board is {table.height} x {table.width}")
    for row, (drawn, wanted) in enumerate(zip(level.rows, board, strict=True)):
        for column, glyph in enumerate(drawn):
            if glyph not in (wanted[column], AGENT):
                raise level.wrong((row, column), f"the table has '{wanted[column]}' here")
    if starts(table, level) is None:
        raise level.wrong(level.find(AGENT)[0], "no episode can begin here: the table has no such state")


def reach(packed: str, level: Level) -> set[Cell]:
    """Every cell that some outcome of some moves leads to."""
    table = unpack(packed)
    found = {starts(table, level) or 0}
    fringe = list(found)
    while fringe:
        outcomes = (one for moves in table.steps[fringe.pop()] for one in moves)
        fresh = {one.state for one in outcomes} - found
        found |= fresh
        fringe.extend(fresh)
    return {(table.places[state].row, table.places[state].column) for state in found}


def _level_text(name: str, table: Table, packed: str) -> str:
    place = table.places[0]
    rows = list(table.layers[place.layer].rows)
    row = rows[place.row]
    rows[place.row] = row[: place.column] + AGENT + row[place.column + 1 :]
    return "\n".join([f"world: {name}", "name: start", f"{KEY}: {packed}", "", *rows, ""])

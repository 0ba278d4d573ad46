"""Levels of ours from a text with maps of other collections, for the command and for the editor."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from parenting.envs import registry
from parenting.envs.foreign_levels import carry
from parenting.envs.foreign_rle import MapRowError
from parenting.envs.foreign_text import ForeignMap, maps
from parenting.envs.levels.spec import Level, LevelError


class ForeignMapError(ValueError):
    """A text holds no map, or one holds what no world of ours has; `line` is None where there is none."""

    def __init__(self, message: str, line: int | None = None) -> None:
        super().__init__(message)
        self.line = line


class Imported(NamedTuple):
    """A level that was made of a map."""

    level: Level
    format: str
    lost: tuple[str, ...]  # what could not be carried over
    refused: str | None  # the rule of ours that it breaks

    @property
    def plain(self) -> dict[str, Any]:
        """The level as JSON has it."""
        return {
            "world": self.level.world,
            "name": self.level.name,
            "format": self.format,
            "rows": list(self.level.rows),
            "text": self.level.text,
            "lost": list(self.lost),
            "refused": self.refused,
        }


def imported(
    text: str, stem: str = "map", form: str | None = None, world: str | None = None
) -> list[Imported]:
    """Return every map of a text as a level.

    Args:
        text: The text.
        stem: The name of a level whose map has none; several are numbered.
        form: The format of the maps; none is found by its signs.
        world: The world of art of gridworlds; none is found by its signs.

    Raises:
        ForeignMapError: there is no map, a row of one is wrong, or one holds what no world of ours has.
    """
    try:
        found = maps(text, form)
    except MapRowError as error:
        raise ForeignMapError(str(error), error.line) from None
    except ValueError as error:
        raise ForeignMapError(str(error)) from None
    return [_one(one, name, world) for one, name in zip(found, _names(found, stem), strict=True)]


def _one(one: ForeignMap, name: str, world: str | None) -> Imported:
    try:
        carried = carry(one, world)
    except ValueError as error:
        raise ForeignMapError(f"{error}.", one.line) from None
    lost = (*one.said, *carried.lost)
    level = Level(name, carried.world, carried.rows, dict(carried.header), name)
    try:
        return Imported(registry.read_level(carried.world, level.text, name), one.format, lost, None)
    except LevelError as error:
        row = error.line - len(level.header) - 3
        where = f"row {row}, column {error.column}" if row > 0 else "its header"
        refused = f"{carried.world} refuses this level at {where}: {error.rule}; mend it by hand"
        return Imported(level, one.format, lost, refused)


def _names(found: Sequence[ForeignMap], stem: str) -> list[str]:
    """Return the levels' own names, or else the stem with a number where there are several."""
    plain = [re.sub(r"\s+", " ", one.name)[:60].strip() for one in found]
    return [name or (stem if len(found) == 1 else f"{stem} {number}") for number, name in enumerate(plain, 1)]

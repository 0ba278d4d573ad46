"""A person's level held against the rules of its world, for the editor, in the sentences of commands."""

from __future__ import annotations

from parenting.envs import registry
from parenting.envs.level_text import SeveralLevelsError, Written, choose, written
from parenting.envs.levels.spec import LevelError
from parenting.server.errors import InvalidFieldsError
from parenting.server.schemas import Schema

TEXT_CHARACTERS = 50_000
"""Characters of a text that may hold several levels, in a request."""
SOURCE = "level"
"""The name of a text that stands in no file."""


class LevelErrorSchema(Schema):
    """The first rule that a level breaks."""

    line: int
    """The line of the text, counted from 1."""
    column: int
    """The column, counted from 1."""
    rule: str
    message: str
    """The whole sentence, as commands print it."""


class CheckedLevelSchema(Schema):
    """A level's text, read as people have it, and what is wrong with it."""

    valid: bool
    name: str | None
    """The level's name; null where it is not valid."""
    text: str | None
    """The level as it is stored; null where it is not valid."""
    header: list[str]
    """The lines that were taken for the header."""
    rows: list[str]
    """The rows that were taken for the art; they need not be of one length where the level is not valid."""
    said: list[str]
    """The cuts and replacements around the art, in sentences without a full stop."""
    levels: list[str]
    """The names of the levels in the text, empty where one has none."""
    error: LevelErrorSchema | None


def check(world: str, text: str, which: str | None = None) -> CheckedLevelSchema:
    """Check one level of a text; `which` is its name or number, where there are several.

    Raises:
        InvalidFieldsError: there is no such world.
    """
    if world not in registry.WORLDS:
        known = ", ".join(registry.WORLDS)
        raise InvalidFieldsError([("world", f"There is no such world. There is: {known}.")])
    found = written(text, registry.spec(world).glyphs)
    names, chosen = [one.name for one in found], Written()
    try:
        chosen = choose(found, which, SOURCE)
        level = registry.read_level(world, text, SOURCE, which)
    except LevelError as error:
        several = isinstance(error, SeveralLevelsError)
        return _checked(Written() if several else chosen, names, error=_error(error))
    return _checked(chosen, names, level.name, level.text)


def _checked(
    chosen: Written,
    names: list[str],
    name: str | None = None,
    text: str | None = None,
    error: LevelErrorSchema | None = None,
) -> CheckedLevelSchema:
    return CheckedLevelSchema(
        valid=error is None,
        name=name,
        text=text,
        header=[line.text for line in chosen.header],
        rows=[line.text for line in chosen.art],
        said=list(chosen.said),
        levels=names,
        error=error,
    )


def _error(error: LevelError) -> LevelErrorSchema:
    return LevelErrorSchema(line=error.line, column=error.column, rule=error.rule, message=str(error))

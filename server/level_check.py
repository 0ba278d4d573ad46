"""A person's level held against the rules of its world, for the editor, in the sentences of commands."""

from __future__ import annotations

from parenting.agent.config import PRESETS, Config, merge
from parenting.envs import registry
from parenting.envs.foreign_hint import foreign_format
from parenting.envs.foreign_import import ForeignMapError, imported
from parenting.envs.foreign_text import FORMATS
from parenting.envs.front_matter import check_front_matter
from parenting.envs.level_text import SeveralLevelsError, Written, choose, lines_of, written
from parenting.envs.levels.spec import LevelError
from parenting.server.errors import InvalidFieldsError
from parenting.server.schemas import Schema
from parenting.weights.cost import estimate

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
    cost: str | None = None
    """A sentence on the cost of a run on it; null: it is little, or the level is not valid."""
    foreign: str | None = None
    """The format of another collection that the text is in, which /levels/import makes a level of."""


class ImportedLevelSchema(Schema):
    """A level that was made of a map of another collection."""

    world: str
    name: str
    format: str
    """xsb, frozenlake, cliffwalking, taxi or gridworlds."""
    rows: list[str]
    text: str
    """The level as it is stored, if its world does not refuse it."""
    lost: list[str]
    """The losses, in sentences without a full stop."""
    refused: str | None
    """The rule of its world that the level breaks; null: none."""


class ImportedLevelsSchema(Schema):
    """The levels that were made of the maps in a text, in its order."""

    recognised: str
    """A sentence on what the text was taken for."""
    levels: list[ImportedLevelSchema]


def import_levels(text: str, form: str | None = None, world: str | None = None) -> ImportedLevelsSchema:
    """Make levels of the maps in a text, as `parenting worlds import` does.

    Raises:
        InvalidFieldsError: there is no such world or no map, or one holds what no world of ours has.
    """
    if world is not None:
        _know(world)
    try:
        found = imported(text, "level", form, world)
    except ForeignMapError as error:
        place = "" if error.line is None else f"Line {error.line}: "
        raise InvalidFieldsError([("text", place + str(error))]) from None
    several = "" if len(found) == 1 else f", {len(found)} of them"
    title = registry.spec(found[0].level.world).title
    recognised = f"This was read as {FORMATS[found[0].format]}{several}, and made a level of {title}."
    return ImportedLevelsSchema(
        recognised=recognised, levels=[ImportedLevelSchema(**one.plain) for one in found]
    )


def _know(world: str) -> None:
    if world not in registry.WORLDS:
        known = ", ".join(registry.WORLDS)
        raise InvalidFieldsError([("world", f"There is no such world. There is: {known}.")])


def check(world: str, text: str, which: str | None = None) -> CheckedLevelSchema:
    """Check one level of a text; `which` is its name or number, where there are several.

    Raises:
        InvalidFieldsError: there is no such world.
    """
    _know(world)
    glyphs = registry.spec(world).glyphs
    found = written(text, glyphs)
    names, chosen = [one.name for one in found], Written()
    try:
        check_front_matter([line.text for line in lines_of(text)], glyphs, SOURCE)
        chosen = choose(found, which, SOURCE)
        level = registry.read_level(world, text, SOURCE, which)
    except LevelError as error:
        several = isinstance(error, SeveralLevelsError)
        checked = _checked(Written() if several else chosen, names, error=_error(error))
        return checked.model_copy(update={"foreign": foreign_format(text)})
    spec = registry.spec(world, level)
    cost = estimate(spec, level, Config.model_validate(merge(PRESETS["conservative"], spec.defaults)))
    checked = _checked(chosen, names, level.name, level.text)
    return checked.model_copy(update={"cost": f"On this level {cost}." if cost.notable else None})


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

"""The editor of levels: a level is painted, or typed without a script, and checked; a run begins on it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

from fastapi import Query, Request, Response

from parenting.envs import registry
from parenting.envs.art import LARGEST, LEVEL_CHARACTERS, SMALLEST
from parenting.envs.levels.spec import Level, WorldSpec
from parenting.envs.people_text import plain
from parenting.server.admission import admitted_router
from parenting.server.deps import Db
from parenting.server.errors import InvalidFieldsError, NotFound
from parenting.server.level_check import CheckedLevelSchema, check, import_levels
from parenting.server.pages.render import page
from parenting.server.pages.start import EMPTY_FORM, FormFields, filled_form

router = admitted_router(include_in_schema=False)

OWN = ("world", "level", "level_text")
"""The fields of the form of a run that the editor has itself; the others are carried along."""

Name = Annotated[str | None, Query(max_length=100)]


@dataclass(frozen=True)
class WorldChoice:
    """A world of the editor, as its script reads it."""

    name: str
    title: str
    legend: str  # glyph -> tile, as JSON, in the order of the codes
    entries: tuple[str, ...]  # of a level's header, besides world and name
    levels: str  # name -> text of the built-in ones, as JSON


@dataclass(frozen=True)
class LevelsPage:
    """The content of web/templates/levels.html."""

    world: str
    text: str
    carried: Mapping[str, str]  # the other fields of the form that a run is started by
    checked: CheckedLevelSchema | None = None
    refused: str = ""  # a text that cannot be checked at all
    converted: Sequence[str] = ()  # sentences on a map of another collection that the text was
    worlds: tuple[WorldChoice, ...] = ()
    legend: Mapping[str, str] = field(default_factory=dict)  # of all worlds, for the tiles
    smallest: int = SMALLEST
    largest: int = LARGEST
    characters: int = LEVEL_CHARACTERS


@router.get("/levels")
def editor(world: Name = None, level: Name = None) -> Response:
    """The editor, with a built-in level to begin with."""
    spec = registry.WORLDS.get(world or next(iter(registry.WORLDS)))
    if spec is None or (level is not None and level not in spec.levels):
        raise NotFound("There is no such level. Choose one on the page of levels: /levels")
    return _page(spec.name, beginning(registry.level(spec.name, level)), {})


@router.post("/levels")
def checked(form: FormFields) -> Response:
    """The editor with a text of one's own, and what is wrong with it."""
    world, text = _given(form)
    return _page(world, text, form, checking=bool(text.strip()))


@router.post("/levels/start")
def begin(request: Request, db: Db, form: FormFields) -> Response:
    """The form of a new run with this level in it; a level that is wrong goes back to the editor."""
    world, text = _given(form)
    found = _page(world, text, form, checking=True)
    if found.status_code != 200:
        return found
    carried = {name: said for name, said in form.items() if name in EMPTY_FORM and name != "level"}
    return filled_form(db, {**carried, "world": world, "level_text": text})


def beginning(level: Level) -> str:
    """Return a built-in level as a text to begin with, without its world and its name."""
    header = "".join(f"{key}: {value}\n" for key, value in level.header.items())
    return (f"{header}\n" if header else "") + "".join(f"{row}\n" for row in level.rows)


def _given(form: Mapping[str, str]) -> tuple[str, str]:
    world = form.get("world", "")
    return world if world in registry.WORLDS else next(iter(registry.WORLDS)), form.get("level_text", "")


def _page(world: str, text: str, form: Mapping[str, str], checking: bool = False) -> Response:
    found, refused, converted = None, "", list[str]()
    if checking:
        try:
            found = check(world, plain(text))
            if found.foreign is not None:
                world, text, converted = _converted(text)
                found = check(world, text)
        except ValueError as error:
            refused = f"{str(error).capitalize()}."
        except InvalidFieldsError as error:
            refused = error.fields[0][1]
    wrong = bool(refused or converted) or (found is not None and not found.valid)
    if not text.strip():
        text = beginning(registry.level(world))
    context: dict[str, Any] = vars(
        LevelsPage(
            world=world,
            text=text,
            carried={name: said for name, said in form.items() if name in EMPTY_FORM and name not in OWN},
            checked=found,
            refused=refused,
            converted=converted,
            worlds=tuple(map(_choice, registry.WORLDS.values())),
            legend={glyph: name for spec in registry.WORLDS.values() for glyph, name in spec.legend.items()},
        )
    )
    return page("levels.html", 422 if wrong else 200, **context)


def _converted(text: str) -> tuple[str, str, list[str]]:
    """Return the first map of a text as world and text of a level, and what is said of it.

    Raises:
        InvalidFieldsError: it holds what no world of ours has.
    """
    found = import_levels(text)
    first = found.levels[0]
    return first.world, first.text, [found.recognised, *(f"{said.capitalize()}." for said in first.lost)]


def _choice(spec: WorldSpec) -> WorldChoice:
    levels = {name: beginning(registry.level(spec.name, name)) for name in spec.levels}
    return WorldChoice(spec.name, spec.title, json.dumps(dict(spec.legend)), spec.keys, json.dumps(levels))

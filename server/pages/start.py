"""The first page: the runs, and a form to start one. Errors stand next to their fields; typing is kept."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from fastapi import Depends, Request, Response

from parenting.envs.levels.spec import WorldSpec
from parenting.envs.registry import WORLDS
from parenting.server.admission import admitted_router
from parenting.server.db import Database
from parenting.server.deps import Db, SettingsOf, notify_worker
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import LARGEST_INT, plan, read_form, start
from parenting.server.pages.options import OPTIONS, Option
from parenting.server.pages.render import page, redirect
from parenting.server.pages.run_list import Find, FindRuns, run_list

router = admitted_router(include_in_schema=False)

PRESET_WORDS = {
    "frugal": "asks before every new move, and needs the fewest answers; for small levels",
    "conservative": "asks before almost every new move; hardly ever dies",
    "lax": "asks about every second new move",
    "direct": "never asks before a move; learns from clips alone",
}
"""The meaning of each preset for the parent, in a line; the form begins with the first."""

NUMBER_ERRORS = {
    "seed": f"A seed is a whole number from 0 to {LARGEST_INT}.",
    "goal": "A goal is a whole number of answers from 1 to 1000000; leave it empty to have none.",
}
"""The sentence next to a field that takes a number and holds something else."""

EMPTY_FORM = {
    "world": next(iter(WORLDS)),
    "level": "",
    "level_text": "",
    "parent": "human",
    "preset": next(iter(PRESET_WORDS)),
    "seed": "0",
    "goal": "",
    **{option.field: "" for option in OPTIONS},
}
"""The form before anything was typed."""


@dataclass(frozen=True)
class StartPage:
    """The content of web/templates/start.html beside the list."""

    fresh: bool  # a new installation: nothing was started or typed yet
    form: Mapping[str, str]  # the text of every field
    errors: Mapping[str, str]  # a sentence for each wrong field
    more_open: bool  # whether one of the settings below the fold was set or is wrong
    focus: str | None  # the first wrong field
    other_errors: Sequence[str]  # sentences on what has no field
    worlds: Collection[WorldSpec] = tuple(WORLDS.values())
    options: Sequence[Option] = OPTIONS
    presets: Mapping[str, str] = field(default_factory=lambda: PRESET_WORDS)


async def text_fields(request: Request) -> dict[str, str]:
    """The text fields of a posted form."""
    return {name: value for name, value in (await request.form()).items() if isinstance(value, str)}


FormFields = Annotated[dict[str, str], Depends(text_fields)]


@router.get("/")
def index(db: Db, find: FindRuns) -> Response:
    """The list of runs and an empty form. `before` is a run's id: those that come behind it in the list."""
    return _page(db, EMPTY_FORM, {}, find)


@router.post("/runs")
def create(request: Request, db: Db, settings: SettingsOf, form: FormFields) -> Response:
    """Start a run and go to it, or show the form again with an error next to each wrong field."""
    given = dict(form)
    if given.get("level_text", "").strip():
        given.pop("level", None)  # a text of one's own stands in the list's place; the form says so
    errors = _errors(given, settings.weights)
    if errors:
        return _page(db, {**EMPTY_FORM, **form}, errors)
    run = start(db, read_form(given), settings.weights)
    notify_worker(request)
    return redirect(f"/runs/{run.public_id}/parent" if run.parent == "human" else f"/runs/{run.public_id}")


def filled_form(db: Database, form: Mapping[str, str]) -> Response:
    """Return the page with a form that is filled in as far as it is known."""
    return _page(db, {**EMPTY_FORM, **form}, {}, filled=True)


def _errors(given: Mapping[str, str], folder: Path) -> dict[str, str]:
    """Return an error for each wrong field: wrong by itself, or in the world that the others name."""
    errors: dict[str, str] = {}
    for _ in range(2):
        try:
            known = {name: text for name, text in given.items() if name not in errors}
            plan(read_form(known), folder)
        except InvalidFieldsError as error:
            errors = {**dict(error.fields), **errors}
    return {name: NUMBER_ERRORS.get(name, said) for name, said in errors.items()}


def _page(
    db: Database,
    form: Mapping[str, str],
    errors: Mapping[str, str],
    find: Find | None = None,
    filled: bool = False,
) -> Response:
    listed = run_list(db, find or Find())
    untouched = not (listed.runs or listed.archived or listed.find.narrows or listed.find.before or errors)
    context = StartPage(
        fresh=untouched and not filled,
        form=form,
        errors=errors,
        more_open=any(form[option.field] or option.field in errors for option in OPTIONS),
        focus=next((field for field in EMPTY_FORM if field in errors), None),
        other_errors=[message for field, message in errors.items() if field not in EMPTY_FORM],
    )
    return page("start.html", 422 if errors else 200, **vars(context), **vars(listed))

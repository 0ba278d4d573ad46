"""The first page: the runs, and a form to start one. Errors stand beside their fields, typing is kept."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, NamedTuple

from fastapi import APIRouter, Depends, Request, Response

from agent.config import PRESETS
from envs.registry import WORLDS
from server import runs
from server.db import Database
from server.deps import Db, SettingsOf, ring
from server.errors import Invalid
from server.pages.measures import measures
from server.pages.render import page, see
from server.pages.words import title
from server.starting import plan, read_form, start
from server.tables import Metric
from server.views import latest_metrics

router = APIRouter(include_in_schema=False)

PRESET_WORDS = {
    "conservative": "asks before almost every new move; hardly ever dies",
    "lax": "asks about every second new move",
    "direct": "never asks before a move; learns from clips alone",
}
"""What a preset means for the parent, in a line; the conservative one first."""


class Option(NamedTuple):
    """A setting of the run that some worlds have; empty is what the world itself sets."""

    name: str  # a field of agent.config.Config
    title: str
    needs: str  # the glyph that a world's legend must hold, if any
    choices: tuple[tuple[str, str], ...]  # values and their names
    hint: str


OPTIONS = (
    Option(
        "pretrain",
        "Pre-training",
        "",
        (
            ("", "As the world has it"),
            ("true", "Begin pre-trained on mazes"),
            ("false", "Begin with nothing"),
        ),
        "Off in Unsafe Exploration, on elsewhere. A level of another size needs weights of its own.",
    ),
    Option(
        "supervised",
        "Supervisor",
        "S",
        (
            ("", "As the world has it"),
            ("present", "There"),
            ("random", "There in half of the episodes"),
            ("absent", "Not there"),
        ),
        "While it isn't there, the agent asks nothing.",
    ),
    Option(
        "inside",
        "The parent's own way inside its cycle",
        "O",
        (("", "Up or down"), ("left", "Left")),
        "It matters for a script's answers.",
    ),
)
"""What the form offers of a run's settings; the rest is for the API and the command line."""

FIRST = {
    "world": next(iter(WORLDS)),
    "level": "",
    "level_text": "",
    "parent": "human",
    "preset": next(iter(PRESETS)),
    "seed": "0",
    **{f"config.{option.name}": "" for option in OPTIONS},
}
"""The form before anything was typed."""


async def form_of(request: Request) -> dict[str, str]:
    """The text fields of a posted form."""
    return {name: value for name, value in (await request.form()).items() if isinstance(value, str)}


FormOf = Annotated[dict[str, str], Depends(form_of)]


@router.get("/")
def index(db: Db) -> Response:
    """The list of runs and an empty form."""
    return _page(db, FIRST, {})


@router.post("/runs")
def create(request: Request, db: Db, settings: SettingsOf, form: FormOf) -> Response:
    """Start a run and go to it; or the form again, with an error beside every wrong field."""
    given = dict(form)
    if given.get("level_text", "").strip():
        given.pop("level", None)  # a text of one's own stands in the list's place; the form says so
    errors = _errors(given, settings.weights)
    if errors:
        return _page(db, {**FIRST, **form}, errors)
    run = start(db, read_form(given), settings.weights)
    ring(request)
    return see(f"/runs/{run.id}" + ("/parent" if run.parent == "human" else ""))


def _errors(given: Mapping[str, str], folder: Path) -> dict[str, str]:
    """Every wrong field: what is wrong by itself, and what is wrong in the world that the others name."""
    errors: dict[str, str] = {}
    for _ in range(2):
        try:
            known = {name: text for name, text in given.items() if name not in errors}
            plan(read_form(known), folder)
        except Invalid as error:
            errors = {**dict(error.fields), **errors}
    return errors


def _page(db: Database, form: Mapping[str, str], errors: Mapping[str, str]) -> Response:
    listed = runs.list_runs(db)
    latest = latest_metrics(db, [run.id for run in listed])
    return page(
        "start.html",
        422 if errors else 200,
        runs=[(run, title(run), measures(run.legend).harm, _deaths(latest, run.id)) for run in listed],
        worlds=WORLDS.values(),
        options=OPTIONS,
        presets=PRESET_WORDS,
        form=form,
        opened=any(form[field] or field in errors for field in FIRST if field.startswith("config.")),
        errors=errors,
        focus=next((field for field in FIRST if field in errors), None),
        elsewhere=[message for field, message in errors.items() if field not in FIRST],
    )


def _deaths(latest: Mapping[int, Metric], run_id: int) -> float | int | None:
    return latest[run_id].values.get("deaths") if run_id in latest else None

"""The first page: the runs, and a form to start one. Errors stand next to their fields; typing is kept."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

from fastapi import Depends, Request, Response
from starlette.datastructures import UploadFile

from parenting.agent.config import offered_preset
from parenting.envs.levels.spec import WorldSpec
from parenting.envs.registry import WORLDS
from parenting.server.admission import admitted_router
from parenting.server.db import Database
from parenting.server.deps import Db, SettingsOf, start_within_limits
from parenting.server.errors import Conflict, InvalidFieldsError
from parenting.server.inherited import (
    AnsweredRun,
    PolicySchema,
    answered_runs,
    chosen_origin,
    chosen_policy,
    schema,
    upload,
)
from parenting.server.missing_weights import missing_weights
from parenting.server.new_run import LARGEST_INT, PRETRAIN, plan, start
from parenting.server.pages.options import OPTIONS, Option
from parenting.server.pages.render import page, redirect
from parenting.server.pages.run_list import Find, FindRuns, run_list
from parenting.server.run_form import read_form
from parenting.server.settings import Settings
from parenting.weights.estimate import MOST_SECONDS, seconds
from parenting.weights.origin import NO_ORIGIN, Origin
from parenting.weights.store import Wanted

router = admitted_router(include_in_schema=False)

PRESET_WORDS = {
    "frugal": "asks before every new move; fewest answers in Unsafe Exploration and Side Effects",
    "conservative": "asks before almost every new move; hardly ever dies",
    "lax": "asks about every second new move",
    "direct": "never asks before a move; learns from clips alone",
}
"""The meaning of each preset for the parent, in a line."""

NUMBER_ERRORS = {
    "seed": f"A seed is a whole number from 0 to {LARGEST_INT}.",
    "goal": "A goal is a whole number of answers from 1 to 1000000; leave it empty to have none.",
    "pace": "A pace is a number of ticks a second, above 0 and up to 1000; leave it empty to have none.",
    "script": "A number of this script is none, too small or too large. An example that is right: noisy:0.1.",
    "config.stages": "The number of stages is a whole number from 1 to 16; leave it empty to have one.",
    "config.mature_every": "A stage ends after a whole number of answers, from 1; or leave it empty.",
    "config.gradient_steps": "Gradient steps are a whole number from 1 to 1000; or leave it empty.",
}
"""The sentence next to a field that takes a number and holds something else."""

BARE = "Input should be "
"""Messages of Pydantic begin with this or hold it. People get a sentence of ours in their place."""

FILE = "policy_file"
"""The field of the form that takes a policy's file."""

EMPTY_FORM = {
    "world": next(iter(WORLDS)),
    "level": "",
    "level_text": "",
    "parent": "human",
    "preset": offered_preset(next(iter(WORLDS))),
    "seed": "0",
    "goal": "",
    "from_policy": "",
    "from_answers": "",
    **{option.field: "" for option in OPTIONS},
}
"""The form before anything was typed."""


class Offer(NamedTuple):
    """Pre-trained weights that a run lacks, and the seconds that they take."""

    wanted: Wanted
    seconds: int


@dataclass(frozen=True)
class StartPage:
    """The content of web/templates/start.html beside the list."""

    fresh: bool  # a new installation: nothing was started or typed yet
    form: Mapping[str, str]  # the text of every field
    errors: Mapping[str, str]  # a sentence for each wrong field
    more_open: bool  # whether one of the settings below the fold was set or is wrong
    focus: str | None  # the first wrong field
    other_errors: Sequence[str]  # sentences on what has no field
    policy: PolicySchema | None = None  # that the form says to begin with
    answered: Sequence[AnsweredRun] = ()  # runs whose answers a run may begin with
    offer: Offer | None = None  # the weights that are missing, and nothing else is wrong
    worlds: Collection[WorldSpec] = tuple(WORLDS.values())
    options: Sequence[Option] = OPTIONS
    presets: Mapping[str, str] = field(default_factory=lambda: PRESET_WORDS)
    offered: Mapping[str, str] = field(
        default_factory=lambda: {world: offered_preset(world) for world in WORLDS}
    )


async def text_fields(request: Request) -> dict[str, str]:
    """The text fields of a posted form."""
    return {name: value for name, value in (await request.form()).items() if isinstance(value, str)}


async def policy_file(request: Request) -> tuple[str, bytes] | None:
    """The name and the bytes of the policy in a posted form; None where no file was chosen."""
    form = await request.form()  # the one of `text_fields`, which has read it by now
    file = form.get(FILE)
    found = (file.filename, await file.read()) if isinstance(file, UploadFile) and file.filename else None
    await form.close()
    return found


PolicyFile = Annotated[tuple[str, bytes] | None, Depends(policy_file)]
FormFields = Annotated[dict[str, str], Depends(text_fields)]


@router.get("/")
def index(db: Db, find: FindRuns) -> Response:
    """The list of runs and an empty form. `before` is a run's id: those that come behind it in the list."""
    return _page(db, EMPTY_FORM, {}, find)


@router.post("/runs")
def create(request: Request, db: Db, settings: SettingsOf, form: FormFields) -> Response:
    """Start a run and go to it, or show the form again with an error next to each wrong field.

    Where only weights made beforehand are missing, the form offers to make them now or to begin without.
    """
    given = settings_of(form)
    errors, origin = _checked(given, settings, db)
    if errors:
        offer = missing(db, settings.weights, given) if PRETRAIN in errors else None
        policy = schema(form["from_policy"], origin) if origin.policy is not None else None
        return _page(db, {**EMPTY_FORM, **form}, errors, offer=offer, policy=policy)
    begin = partial(start, db, read_form(given), settings.weights, origin, settings.bound, settings.runs)
    run = start_within_limits(request, begin)
    return redirect(f"/runs/{run.public_id}/parent" if run.parent == "human" else f"/runs/{run.public_id}")


@router.post("/policies")
def take_policy(db: Db, form: FormFields, file: PolicyFile) -> Response:
    """The form with a policy that was uploaded, which the run begins with; nothing is started."""
    given = {**form, "from_policy": ""}
    try:
        if file is None:
            raise InvalidFieldsError([("from_policy", "Choose the file of a policy first.")])
        policy = upload(db, *file)
    except InvalidFieldsError as error:
        return _page(db, {**EMPTY_FORM, **given}, dict(error.fields))
    except Conflict as error:
        return _page(db, {**EMPTY_FORM, **given}, {"from_policy": error.message})
    return filled_form(db, {**given, "from_policy": policy.sha256}, policy)


def _origin(db: Database, given: Mapping[str, str]) -> Origin:
    """Return what the form says to begin with.

    Raises:
        InvalidFieldsError: it is not there, or a file was chosen and not sent.
    """
    if given.get(FILE) and not given.get("from_policy"):
        raise InvalidFieldsError([("from_policy", "Choose the file again, and press Use this file.")])
    return chosen_origin(db, given.get("from_policy") or None, given.get("from_answers") or None)


def settings_of(form: Mapping[str, str]) -> dict[str, str]:
    """Return the fields of a run: a level of one's own stands in the list's place; the form says so."""
    own = bool(form.get("level_text", "").strip())
    return {name: text for name, text in form.items() if not (own and name == "level")}


def missing(db: Database, folder: Path, given: Mapping[str, str]) -> Offer | None:
    """Return the weights that alone a run lacks; None if it lacks none or more, or they take too long."""
    try:
        wanted = missing_weights(read_form(given), folder, db)
    except InvalidFieldsError:
        return None
    needs = 0 if wanted is None else seconds(wanted)
    return None if wanted is None or needs > MOST_SECONDS else Offer(wanted, needs)


def filled_form(db: Database, form: Mapping[str, str], policy: PolicySchema | None = None) -> Response:
    """Return the page with a form that is filled in as far as it is known.

    `policy` is the one that the form names, where its file was just read.
    """
    preset = offered_preset(form.get("world", EMPTY_FORM["world"]))
    return _page(db, {**EMPTY_FORM, "preset": preset, **form}, {}, filled=True, policy=policy)


def _checked(given: Mapping[str, str], settings: Settings, db: Database) -> tuple[dict[str, str], Origin]:
    """Return an error for each wrong field, alone or in the world that the others name, and the origin."""
    errors, origin = dict[str, str](), NO_ORIGIN
    try:
        origin = _origin(db, given)
    except InvalidFieldsError as error:
        errors = dict(error.fields)
    for _ in range(2):
        try:
            known = {name: text for name, text in given.items() if name not in errors}
            plan(read_form(known), settings.weights, origin, db, settings.bound)
        except InvalidFieldsError as error:
            errors = {**dict(error.fields), **errors}
    said = {name: NUMBER_ERRORS.get(name, said) if BARE in said else said for name, said in errors.items()}
    return said, origin


def _page(
    db: Database,
    form: Mapping[str, str],
    errors: Mapping[str, str],
    find: Find | None = None,
    filled: bool = False,
    offer: Offer | None = None,
    policy: PolicySchema | None = None,
) -> Response:
    listed = run_list(db, find or Find())
    wrong = bool(errors)
    if offer is not None:
        errors = {}  # the missing weights are all that is wrong, and the offer says so
    untouched = not (listed.runs or listed.archived or listed.find.narrows or listed.find.before or wrong)
    context = StartPage(
        fresh=untouched and not filled,
        form=form,
        errors=errors,
        more_open=any(form[option.field] or option.field in errors for option in OPTIONS),
        focus=next((field for field in EMPTY_FORM if field in errors), None),
        other_errors=[message for field, message in errors.items() if field not in EMPTY_FORM],
        policy=policy or (chosen_policy(db, form["from_policy"]) if form["from_policy"] else None),
        answered=answered_runs(db),
        offer=offer,
    )
    return page("start.html", 422 if wrong else 200, **vars(context), **vars(listed))

"""`parenting start`: start a run in the database, with every setting that the form of the first page has."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from parenting.agent.config import FIELDS, Config, v1_names
from parenting.commands.before_run import PRETRAIN, provide
from parenting.commands.beginnings import FromAnswers, FromPolicy, begins_with
from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors, settings
from parenting.commands.level_file import LEVEL, chosen_level
from parenting.commands.printing import say
from parenting.envs import registry
from parenting.envs.names import did_you_mean
from parenting.parents.grammar import ParentError, read_script
from parenting.server import new_run
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.missing_weights import missing_weights
from parenting.server.notify import Notifier
from parenting.server.reads.schemas import run_schema
from parenting.server.run_form import FORM_FIELDS, read_form
from parenting.server.tables import Run
from parenting.weights.cost import estimate
from parenting.weights.origin import Origin

OPTIONS = ("world", "level", "level_text", "preset", "parent", "script", "seed", "goal", "finish", "name")
"""The settings of a run that are arguments or options of their own; `--set` sets the others."""


def start(
    world: Annotated[str, typer.Argument(help="A world; `parenting worlds` lists them.")],
    level: Annotated[str | None, LEVEL] = None,
    preset: Annotated[str, typer.Option(help="conservative, lax, direct or frugal.")] = "conservative",
    parent: Annotated[
        str,
        typer.Option(
            metavar="human|NAME[:KEY=VALUE,...]",
            help="human: people answer on the pages or by the API. Any other, such as scripted or noisy:0.1: "
            "the worker answers; `parenting parents` lists them.",
        ),
    ] = "human",
    seed: Annotated[str, typer.Option(help="The same seed and answers give the same run.")] = "0",
    goal: Annotated[
        str | None, typer.Option(help="Answers after which the run rests.", show_default="none")
    ] = None,
    finish: Annotated[
        str | None,
        typer.Option(
            metavar="optimal|goal:N|stages:T|never",
            help="What ends the run: its policy is optimal, N answers are heard, stage T is over.",
            show_default="optimal with a script, else never",
        ),
    ] = None,
    name: Annotated[str | None, typer.Option(help="A name for the lists.", show_default="none")] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="Another setting or a hyperparameter; may be repeated."
        ),
    ] = None,
    from_policy: FromPolicy = None,
    from_answers: FromAnswers = None,
    pretrain: Annotated[str | None, PRETRAIN] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the run as JSON, as in the API, and nothing else.")
    ] = False,
) -> None:
    """Start a run in the database; a worker raises it (`parenting up` or `parenting worker`).

    `--set` takes the settings that the form of the first page has (pace, guidance_layout, practice) and every
    hyperparameter. `--from-policy` begins with the weights of a policy, `--from-answers` with X of earlier
    answers; the run keeps their hashes and the run that they are of.

    Exit codes: 0 started; 2 a setting is wrong, a file does not fit, or there is no database yet.

    Example: parenting start unsafe-exploration --goal 50 --set guidance_layout=two --set practice=required
    """
    with friendly_errors():
        given = {"world": world, "preset": preset, "seed": seed, **_parent(parent)}
        given |= {
            key: text
            for key, text in (("goal", goal), ("finish", finish), ("name", name))
            if text is not None
        }
        given |= _level(world, level) | _settings(changes or [])
        chosen, origin = settings(), begins_with(from_policy, from_answers)
        with database() as db:
            try:
                given |= _weights(db, given, chosen.weights, pretrain, origin, quiet=as_json)
                run = new_run.start(db, read_form(given), chosen.weights, origin, chosen.bound, chosen.runs)
            except InvalidFieldsError as error:
                raise UsageError(
                    "\n".join(_said(field, given, rule) for field, rule in error.fields)
                ) from None
            shown = run_schema(db, run.id)
        Notifier(chosen.data, "worker").notify()
    if as_json:
        say(json.dumps(shown.model_dump(mode="json")))
        return
    page = "parent" if run.parent == "human" else ""
    _tell_cost(run)
    say(f"Run {run.id} is started. Its page: /runs/{run.public_id}/{page}".rstrip("/"))


def _weights(
    db: Database, given: dict[str, str], folder: Path, choice: str | None, origin: Origin, *, quiet: bool
) -> dict[str, str]:
    """Provide the pre-trained weights that the run lacks, or return the field by which it begins without.

    Raises:
        UsageError: they are missing, and nothing was chosen.
        InvalidFieldsError: a field cannot be read.
    """
    if origin.policy is not None:
        return {}
    lacking = missing_weights(read_form(given), folder, db)
    if lacking is None or provide(lacking, choice, folder, quiet=quiet):
        return {}
    return {new_run.PRETRAIN: "false"}


def _tell_cost(run: Run) -> None:
    """Say what ticks and checkpoints of an expensive run cost."""
    level = registry.level(run.world, run.level_text)
    cost = estimate(registry.spec(run.world, level), level, Config.model_validate(run.config))
    if cost.notable:
        say(f"This run is expensive: {cost}.", err=True)


def _parent(text: str) -> dict[str, str]:
    """Return the fields that say who answers.

    Raises:
        UsageError: the text names no parent that a worker can be.
    """
    if text == "human":
        return {"parent": text}
    try:
        return {"parent": "scripted", "script": read_script(text)}
    except ParentError as error:
        raise UsageError(f"--parent: {error} Or: human.") from None


def _level(world: str, name_or_file: str | None) -> dict[str, str]:
    """Return the fields that say which level it is: the name of one that is built in, or a text."""
    found = chosen_level(world, name_or_file)
    built_in = name_or_file is None or name_or_file in registry.spec(world).levels
    return {"level": found.name} if built_in else {"level_text": found.text}


def _settings(changes: list[str]) -> dict[str, str]:
    """Read `--set` as fields of the form.

    Raises:
        UsageError: names every change that is not one.
    """
    names = [name for name in FORM_FIELDS if name not in OPTIONS]
    known = {**{name: name for name in names}, **dict.fromkeys(FIELDS), **dict.fromkeys(Config.model_fields)}
    found: dict[str, str] = {}
    wrong: list[str] = []
    for change in changes:
        key, equals, value = change.partition("=")
        if not equals:
            wrong.append(f"--set: '{change}' is not KEY=VALUE. Write it as --set pace=5.")
        elif key in OPTIONS:
            option = "parent" if key == "script" else key
            wrong.append(f"--set: '{key}' has an option of its own: --{option}.")
        elif key not in known:
            hint = did_you_mean(key, known)
            wrong.append(f"--set: there is no setting '{key}'.{hint} There is: {', '.join(known)}.")
        else:
            found[known[key] or _hyperparameter(key)] = value
    if wrong:
        raise UsageError("\n".join(wrong))
    return found


def _hyperparameter(key: str) -> str:
    """Return the field of a hyperparameter by the name that the API has for it."""
    (name,) = v1_names({FIELDS.get(key, key): None})
    return f"config.{name}"


def _said(field: str, given: dict[str, str], rule: str) -> str:
    value = given.get(field)
    told = field.removeprefix("config.")
    return f"{told}: {rule}" if value is None or "\n" in value else f"{told}={value}: {rule}"

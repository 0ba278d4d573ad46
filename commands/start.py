"""`parenting start`: start a run in the database, with every setting that the form of the first page has."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated

import typer

from parenting.agent.config import Config
from parenting.commands.before_run import PRETRAIN
from parenting.commands.beginnings import FromAnswers, FromPolicy, begins_with
from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors, settings
from parenting.commands.level_file import LEVEL
from parenting.commands.printing import say
from parenting.commands.run_settings import changes_of, level_of, parent_of, said, weights_of
from parenting.envs import registry
from parenting.server import new_run
from parenting.server.errors import InvalidFieldsError
from parenting.server.notify import Notifier
from parenting.server.reads.schemas import run_schema
from parenting.server.run_form import read_form
from parenting.server.tables import Run
from parenting.weights.cost import estimate


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
        _refuse_empty({"preset": preset, "parent": parent, "seed": seed, "goal": goal, "finish": finish})
        given = {"world": world, "preset": preset, "seed": seed, **parent_of(parent)}
        given |= {
            key: text
            for key, text in (("goal", goal), ("finish", finish), ("name", name))
            if text is not None
        }
        given |= level_of(world, level) | changes_of(changes or [])
        chosen, origin = settings(), begins_with(from_policy, from_answers)
        with database() as db:
            try:
                given |= weights_of(db, given, chosen.weights, pretrain, origin, quiet=as_json)
                run = new_run.start(db, read_form(given), chosen.weights, origin, chosen.bound, chosen.runs)
            except InvalidFieldsError as error:
                raise UsageError(
                    "\n".join(said(field, given, rule) for field, rule in error.fields)
                ) from None
            shown = run_schema(db, run.id)
        Notifier(chosen.data, "worker").notify()
    if as_json:
        say(json.dumps(shown.model_dump(mode="json")))
        return
    page = "parent" if run.parent == "human" else ""
    _tell_cost(run)
    say(f"Run {run.id} is started. Its page: /runs/{run.public_id}/{page}".rstrip("/"))


def _refuse_empty(options: Mapping[str, str | None]) -> None:
    """Refuse an option that is given without a value, which the form takes for an absent one.

    Raises:
        UsageError: one is.
    """
    for name, value in options.items():
        if value is not None and not value.strip():
            raise UsageError(f"--{name}: '{value}' is not a value. Give one, or leave --{name} out.")


def _tell_cost(run: Run) -> None:
    """Say what ticks and checkpoints of an expensive run cost."""
    level = registry.level(run.world, run.level_text)
    cost = estimate(registry.spec(run.world, level), level, Config.model_validate(run.config))
    if cost.notable:
        say(f"This run is expensive: {cost}.", err=True)

"""`parenting run`: raise agents by a scripted parent, in tensors and without a database."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer
from pydantic import ValidationError

from parenting.agent.config import FIELDS, PRESETS, Config, UnknownPresetError, compose, too_large
from parenting.commands.before_run import PRETRAIN, provide
from parenting.commands.beginnings import FromAnswers, FromPolicy, begins_with
from parenting.commands.errors import UsageError, exit_on_interrupt, friendly_errors, settings
from parenting.commands.level_file import LEVEL, chosen_level
from parenting.commands.parents import chosen_parent
from parenting.commands.printing import say
from parenting.commands.run_report import page
from parenting.commands.run_store import AT_THE_END, UNSTORED, open_store, store_trials, title_of
from parenting.commands.run_trackers import TRACKER, chosen_trackers, tell_trackers
from parenting.envs import registry
from parenting.envs.levels.spec import Level
from parenting.envs.names import UnknownNameError, did_you_mean
from parenting.weights.origin import Origin
from parenting.weights.store import NoWeightsError, Wanted, find

if TYPE_CHECKING:
    from parenting.agent.beginning import Beginning
    from parenting.experiments.training.chunks import TrainPlan
    from parenting.experiments.training.counts import OnProgress
    from parenting.experiments.training.counts import Progress as Now
    from parenting.experiments.training.stop_rule import StopRule


def run(
    world: Annotated[str, typer.Argument(help="A world; `parenting worlds` lists them.")],
    level: Annotated[str | None, LEVEL] = None,
    preset: Annotated[str, typer.Option(help="conservative, lax, direct or frugal.")] = "conservative",
    parent: Annotated[
        str, typer.Option(metavar="NAME[:KEY=VALUE,...]", help="The parent; several errors are joined by +.")
    ] = "scripted",
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a hyperparameter; may be repeated."),
    ] = None,
    trials: Annotated[int, typer.Option(min=1, max=1_000_000, help="Number of agents.")] = 1,
    seed: Annotated[
        int, typer.Option(min=0, max=2**53 - 1, help="Seed; trial i of a seed is always the same agent.")
    ] = 0,
    max_ticks: Annotated[
        int, typer.Option(min=1, max=10**9, help="Give a trial up as unfinished after this many ticks.")
    ] = 20_000,
    until: Annotated[
        str | None,
        typer.Option(
            metavar="optimal|queries:N|ticks:N",
            help="Condition that ends a trial.",
            show_default="optimal; queries:1000 in reward-hacking",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Number of processes.", show_default="one a core")
    ] = None,
    from_policy: FromPolicy = None,
    from_answers: FromAnswers = None,
    pretrain: Annotated[str | None, PRETRAIN] = None,
    store: Annotated[
        bool, typer.Option("--store", help="Store each trial as a run of the database, to be compared there.")
    ] = False,
    name: Annotated[str | None, typer.Option(help="With --store, the name of these runs.")] = None,
    tracker: Annotated[list[str] | None, TRACKER] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the results as JSON and nothing else.")
    ] = False,
) -> None:
    """Train agents with a scripted parent (Sec. 3.1.3), all at once, and count deaths and queries.

    The last lines report the outcomes of their argmax policies.

    With --store the trials stand in the database afterwards, as runs that are over, beside those of people.
    A --tracker is told of each trial, too.

    Example: parenting run unsafe-exploration --preset conservative --trials 100
    """
    with friendly_errors():
        title = title_of(name, store)
        _known(world, preset)
        found = chosen_level(world, level)
        config = _config(world, preset, changes or [])
        goal = _until(world, until)
        config = _mature(config, goal)
        spec = chosen_parent(parent)
        origin = begins_with(from_policy, from_answers)
        _fits(origin, found, config)
        weights = None
        if origin.policy is None:
            config, weights = _weights(found, config, pretrain, quiet=as_json)
        trackers = chosen_trackers(tracker)
        if store:
            open_store().close()  # what is wrong with it is told before the work, not after
    from parenting._process import settle
    from parenting.experiments.runner.processes import WorkersDiedError
    from parenting.experiments.training.chunks import TrainPlan, train_in_chunks
    from parenting.experiments.training.summary import summarise

    settle()
    plan = TrainPlan(world, found.text, config, seed, trials, goal, max_ticks, weights, str(spec))
    if origin.about is not None:
        plan = plan._replace(beginning=_beginning(origin, found, config), origin=origin.about)
    plan = plan._replace(history=store or bool(trackers))
    began = time.monotonic()
    try:
        with exit_on_interrupt(UNSTORED if store else "Stopped."), _bar(plan) as progress:
            outcomes = train_in_chunks(plan, workers or os.cpu_count() or 1, progress)
    except WorkersDiedError as error:
        say(str(error), err=True)
        raise typer.Exit(1) from None
    results = summarise(plan, found.name, outcomes, time.monotonic() - began)
    with exit_on_interrupt(AT_THE_END), friendly_errors():
        try:
            if store:
                results["runs"] = store_trials(plan, found, preset, outcomes, title)
            tell_trackers(trackers, plan, found, outcomes, title, results.get("runs"))
        finally:
            say(json.dumps(results) if as_json else page(results))


def _fits(origin: Origin, level: Level, config: Config) -> None:
    """Check what the trials begin with against their world and config.

    Raises:
        UsageError: it does not fit; the sentence names the field.
    """
    if wrong := origin.misfits(level, config):
        raise UsageError("\n".join(f"{field}: {said}" for field, said in wrong))


def _beginning(origin: Origin, level: Level, config: Config) -> Beginning:
    from parenting.agent.init import world_of
    from parenting.server.beginnings import beginning

    return beginning(origin, world_of(level.world, level, config), config)


def _known(world: str, preset: str) -> None:
    """Check the names of the world and of the preset.

    Raises:
        UsageError: there is none of this name; the sentence names the argument or the option.
    """
    try:
        registry.spec(world)
    except UnknownNameError as error:
        raise UsageError(f"WORLD: {error}") from None
    if preset not in PRESETS:
        raise UsageError(f"--preset: {UnknownPresetError(preset)}")


def _config(world: str, preset: str, changes: list[str]) -> Config:
    """Compose preset, world and `--set`; every change that is wrong has its sentence."""
    given, wrong = _read(changes)
    try:
        config = compose(preset, registry.defaults(world), given, strict=False)
    except ValidationError as error:
        wrong += [_said(str(one["loc"][0]), given, one["msg"]) for one in error.errors()]
        raise UsageError("\n".join(wrong)) from None
    if config.gamma == 1 and not registry.spec(world).ends_at_goal:
        wrong.append(f"--set: gamma must be below 1 in {world}, where rewards never end; 0.9 is the default.")
    wrong += [f"--set: {name}={said}" for name, said in too_large(config).items()]
    if wrong:
        raise UsageError("\n".join(wrong))
    return config


def _read(changes: list[str]) -> tuple[dict[str, object], list[str]]:
    """Read `--set`: the hyperparameters by the names of their fields, and what is wrong, in sentences."""
    given: dict[str, object] = {}
    written: dict[str, str] = {}
    wrong: list[str] = []
    for change in changes:
        key, equals, value = change.partition("=")
        name = FIELDS.get(key, key)
        if not equals:
            wrong.append(f"--set: '{change}' is not KEY=VALUE. Write it as --set p_guid=0.9.")
        elif name not in Config.model_fields:
            known = ", ".join(Config.model_fields)
            hint = did_you_mean(key, (*Config.model_fields, *FIELDS))
            wrong.append(f"--set: there is no hyperparameter '{key}'.{hint} There is: {known}.")
        elif written.setdefault(name, key) != key:
            wrong.append(f"--set: {written[name]} and {key} are two names of one setting: give one of them.")
        elif name in given:
            wrong.append(f"--set: '{key}' is given twice. Give it once.")
        else:
            given[name] = None if value.lower() in ("none", "null") else value
            if name != key:
                say(f"{key} is now {name}; the old name will go with the next version.", err=True)
    return given, wrong


def _said(name: str, given: dict[str, object], rule: str) -> str:
    return f"--set: {name}={given.get(name)}: {rule}. {Config.model_fields[name].description}"


def _until(world: str, text: str | None) -> StopRule:
    """The condition that ends a trial; in a world without a goal no policy is optimal."""
    from parenting.experiments.training.stop_rule import read_stop_rule

    spec = registry.spec(world)
    try:
        usual = "optimal" if spec.ends_at_goal else "queries:1000"
        return read_stop_rule(usual if text is None else text, spec)
    except ValueError as error:
        raise UsageError(f"--until: {error}") from None


def _mature(config: Config, until: StopRule) -> Config:
    """A budget of queries for each stage and one for all of them say how many stages there are."""
    if config.queries_per_stage is None or "max_clip_length" in config.model_fields_set:
        return config
    if until.kind != "queries":
        raise UsageError(
            "--set: queries_per_stage has no effect in a run of one stage, since the last stage never ends."
            " Set the number of stages, such as --set max_clip_length=2, or use --until queries:N."
        )
    stages = -(-until.number // config.queries_per_stage)
    try:
        return Config.model_validate({**config.model_dump(by_alias=False), "max_clip_length": stages})
    except ValidationError as error:
        raise UsageError(
            f"--until: {until.number} queries at queries_per_stage={config.queries_per_stage} are {stages}"
            f" stages: {error.errors()[0]['msg']}. Set the number of stages, such as --set max_clip_length=4."
        ) from None


def _weights(
    level: Level, config: Config, pretrain: str | None, *, quiet: bool
) -> tuple[Config, bytes | None]:
    """The config, and the file of pre-trained weights that these trials begin with (Sec. 3.1.4)."""
    if not config.pretrain:
        return config, None
    wanted, folder = Wanted(registry.spec(level.world), level.height, level.width), settings().weights
    try:
        return config, find(wanted, folder).read_bytes()
    except NoWeightsError:
        if provide(wanted, pretrain, folder, quiet=quiet):
            return config, find(wanted, folder).read_bytes()
    without = {**config.model_dump(by_alias=False), "pretrain": False}
    return Config.model_validate(without), None


@contextmanager
def _bar(plan: TrainPlan) -> Iterator[OnProgress | None]:
    """A progress bar on standard error, where that is a terminal: of queries where they are the goal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    asking = plan.until.kind == "queries"
    columns = (
        TextColumn("queries" if asking else "trials"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("tick {task.fields[tick]}"),
        TimeElapsedColumn(),
    )

    def show(now: Now) -> None:
        bar.update(task, completed=now.queries if asking else now.trials, tick=now.ticks)

    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=plan.trials * (plan.until.number if asking else 1), tick=0)
        yield show

"""`parenting run`: raise agents by a scripted parent, in tensors and without a database."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from pydantic import ValidationError

from agent.config import Config, UnknownPreset, compose
from envs import registry
from envs.levels.kind import Level, LevelError

if TYPE_CHECKING:
    from experiments.chunks import Plan
    from experiments.trials import Progress, Tally, Until

COUNTS = ("deaths", "guidance", "preference", "ticks")


class Wrong(ValueError):
    """An option is not as it should be; the sentence says which and what would do."""


def run(
    world: Annotated[str, typer.Argument(help="A world; `parenting worlds` lists them.")],
    level: Annotated[str | None, typer.Option(help="A built-in level's name, or a level's file.")] = None,
    preset: Annotated[str, typer.Option(help="conservative, lax or direct.")] = "conservative",
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a hyperparameter; may be repeated."),
    ] = None,
    trials: Annotated[int, typer.Option(min=1, help="Agents to raise.")] = 1,
    seed: Annotated[
        int, typer.Option(min=0, max=2**53 - 1, help="Trial i of a seed is always the same agent.")
    ] = 0,
    max_ticks: Annotated[
        int, typer.Option(min=1, help="Ticks after which a trial is left unfinished.")
    ] = 20_000,
    until: Annotated[
        str, typer.Option(metavar="optimal|queries:N|ticks:N", help="When a trial is finished.")
    ] = "optimal",
    workers: Annotated[int | None, typer.Option(min=1, help="Processes. [default: one a core]")] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the results as JSON and nothing else.")
    ] = False,
) -> None:
    """Raise agents by the scripted parent (Sec. 3.1.3), all at once, and count deaths and queries.

    Example: parenting run unsafe-exploration --preset conservative --trials 100
    """
    with _plainly():
        found = _level(world, level)
        config = _config(world, preset, changes or [])
        goal = _until(until)
    import torch

    from experiments.chunks import Plan, run

    torch.set_num_threads(1)
    plan = Plan(world, found.text, config, seed, trials, goal, max_ticks)
    began = time.monotonic()
    with _bar(trials) as progress:
        tally = run(plan, workers or os.cpu_count() or 1, progress)
    results = summarise(plan, found.name, tally, time.monotonic() - began)
    typer.echo(json.dumps(results) if as_json else _page(results))


def summarise(plan: Plan, level: str, tally: Tally, seconds: float) -> dict[str, Any]:
    """The results as plain data. Means and deviations (over n - 1) are of the finished trials; the others are
    counted.
    """
    rows = {name: getattr(tally, name).tolist() for name in (*COUNTS, "optimal")}
    finished = {name: getattr(tally, name)[tally.finished].double() for name in COUNTS}
    some, several = int(tally.finished.sum()) > 0, int(tally.finished.sum()) > 1
    return {
        "world": plan.world,
        "level": level,
        "seed": plan.seed,
        "until": str(plan.until),
        "max_ticks": plan.max_ticks,
        "config": plan.config.model_dump(mode="json"),
        "trials": [dict(zip(rows, row, strict=True)) for row in zip(*rows.values(), strict=True)],
        "unfinished": int((~tally.finished).sum()),
        "mean": {name: float(values.mean()) if some else None for name, values in finished.items()},
        "sd": {name: float(values.std()) if several else None for name, values in finished.items()},
        "seconds": round(seconds, 2),
    }


def _level(world: str, name_or_file: str | None) -> Level:
    """A built-in level, or one from a file: a name that is not built in and exists as a file is one."""
    if name_or_file is None or name_or_file in registry.kind(world).levels:
        return registry.level(world, name_or_file)
    path = Path(name_or_file)
    if not path.is_file():
        known = ", ".join(registry.kind(world).levels)
        raise Wrong(f"--level: '{name_or_file}' is neither a level of {world} ({known}) nor a file.")
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise Wrong(f"--level: {name_or_file} cannot be read as text: {error}.") from None
    return registry.level(world, text + "\n", source=name_or_file)


def _config(world: str, preset: str, changes: list[str]) -> Config:
    given: dict[str, object] = {}
    for change in changes:
        key, equals, value = change.partition("=")
        if not equals:
            raise Wrong(f"--set: '{change}' is not KEY=VALUE. Write it as --set p_guid=0.9.")
        if key not in Config.model_fields:
            raise Wrong(
                f"--set: there is no hyperparameter '{key}'; there is: {', '.join(Config.model_fields)}."
            )
        given[key] = None if value.lower() in ("none", "null") else value
    try:
        return compose(preset, registry.defaults(world), given, strict=False)
    except ValidationError as error:
        first = error.errors()[0]
        name = str(first["loc"][0])
        raise Wrong(
            f"--set: {name}={given.get(name)}: {first['msg']}. {Config.model_fields[name].description}"
        ) from None


def _until(text: str) -> Until:
    from experiments.trials import Until

    kind, colon, number = text.partition(":")
    if kind == "optimal" and not colon:
        return Until("optimal")
    if kind in ("queries", "ticks") and number.isascii() and number.isdigit() and int(number) > 0:
        return Until(kind, int(number))  # type: ignore[arg-type]
    raise Wrong(f"--until: '{text}' is none of optimal, queries:N, ticks:N with N at least 1.")


@contextmanager
def _plainly() -> Iterator[None]:
    """Print what is wrong as a sentence, and exit with 2."""
    try:
        yield
    except (Wrong, UnknownPreset, registry.UnknownName, LevelError) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(2) from None


@contextmanager
def _bar(trials: int) -> Iterator[Progress | None]:
    """A progress bar on standard error, where that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("trials"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("tick {task.fields[tick]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("trials", total=trials, tick=0)
        yield lambda finished, tick: bar.update(task, completed=finished, tick=tick)


def _page(results: dict[str, Any]) -> str:
    """The results for the reader."""
    number, optimal = len(results["trials"]), sum(row["optimal"] for row in results["trials"])
    lines = [
        f"{results['world']}, {results['level']}: {number} trials"
        f" until {results['until']}, {results['seconds']} s",
        f"  optimal     {optimal} of {number}",
    ]
    for name in COUNTS:
        mean, sd = results["mean"][name], results["sd"][name]
        said = "-" if mean is None else f"{mean:.2f}" + ("" if sd is None else f" +- {sd:.2f}")
        lines.append(f"  {name:<11} {said}")
    if results["unfinished"]:
        lines.append(
            f"  unfinished  {results['unfinished']} after {results['max_ticks']} ticks; not in the means"
        )
    return "\n".join(lines)

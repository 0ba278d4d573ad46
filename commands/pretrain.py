"""`parenting pretrain`: weights that can walk, from random mazes (Sec. 3.1.4)."""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from parenting.commands.errors import UsageError, friendly_errors, reason, settings
from parenting.commands.printing import say
from parenting.envs import registry
from parenting.envs.levels.spec import WorldSpec
from parenting.weights import store
from parenting.weights.store import Wanted

if TYPE_CHECKING:
    from parenting.experiments.training.pretrain import PretrainResult, Progress

MAX_STEPS = 50_000
BARS = "▁▂▃▄▅▆▇█"


def pretrain(
    world: Annotated[
        str | None, typer.Option(help="World whose legend to use; without it, every world that pre-trains.")
    ] = None,
    level: Annotated[
        str | None, typer.Option(help="Built-in level whose size to use; without it, all of them.")
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="HxW", help="Rows and columns, instead of a level's.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**53 - 1, help="Seed of the weights and episodes.")] = 0,
    max_steps: Annotated[
        int, typer.Option(min=1, help="Stop after this many steps; the next call continues.")
    ] = MAX_STEPS,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the files.", show_default="weights in the data folder")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Train again where weights exist already.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the results as JSON and nothing else.")
    ] = False,
) -> None:
    """Pre-train a policy on random mazes until it has converged.

    Ctrl-C loses no work: the next call continues.

    Example: parenting pretrain --world side-effects --level box
    """
    with friendly_errors():
        folder = out or settings().weights
        wanted = _wanted(world, level, size)
    known = (folder,) if out else (folder, store.SHIPPED)
    results = [
        _there(each, known, quiet=as_json)
        if not force and _files(each, known)
        else make(each, folder, seed, max_steps, quiet=as_json)
        for each in wanted
    ]
    if as_json:
        say(json.dumps({"weights": results}))


def _files(wanted: Wanted, folders: tuple[Path, ...]) -> list[Path]:
    """The files of these weights that there are."""
    return [path for folder in folders if (path := folder / f"{wanted.name}{store.SUFFIX}").is_file()]


def _there(wanted: Wanted, folders: tuple[Path, ...], *, quiet: bool) -> dict[str, Any]:
    """The file that a run would take; nothing is made."""
    path = _files(wanted, folders)[0]
    if not quiet:
        say(f"{path} exists already; --force trains it again.")
    return {"path": str(path), "sha256": store.digest(path.read_bytes())}


def make(wanted: Wanted, folder: Path, seed: int, max_steps: int, *, quiet: bool) -> dict[str, Any]:
    """Pre-train weights into a folder, and return what was measured, which is printed unless `quiet`.

    Raises:
        Exit: It was interrupted, did not converge, or the folder cannot be written.
    """
    from parenting._process import settle
    from parenting.experiments.training.pretrain import DamagedWorkError, UnconvergedError, pretrain

    settle()
    began = time.monotonic()
    try:
        with _bar(wanted.name, max_steps) as progress:
            done = pretrain(wanted, folder, seed, max_steps, progress)
    except KeyboardInterrupt:
        say("Interrupted; the same command goes on from here.", err=True)
        raise typer.Exit(130) from None
    except (UnconvergedError, DamagedWorkError) as error:
        say(str(error), err=True)
        raise typer.Exit(1) from None
    except OSError as error:
        say(f"{folder} cannot be written: {reason(error)}.", err=True)
        raise typer.Exit(2) from None
    found = _described(done, time.monotonic() - began)
    if not quiet:
        say(_page(found))
    return found


def _described(done: PretrainResult, seconds: float) -> dict[str, Any]:
    return {
        "path": str(done.path),
        "sha256": done.sha256,
        "steps": done.steps,
        "mean_return": round(done.mean_return, 3),
        **{name: round(value, 4) for name, value in done.exam._asdict().items()},
        "curve": [round(value, 3) for value in done.curve],
        "seconds": round(seconds, 1),
    }


def _wanted(world: str | None, level: str | None, size: str | None) -> list[Wanted]:
    """The weights that are asked for, each once."""
    if level is not None and size is not None:
        raise UsageError("--level and --size both name a size; give one of them.")
    if level is not None and world is None:
        raise UsageError("--level needs its --world.")
    chosen = [registry.spec(world)] if world else [spec for spec in registry.WORLDS.values() if _walks(spec)]
    wanted = [Wanted(spec, *found) for spec in chosen for found in _sizes(spec, level, size)]
    return list({one.name: one for one in wanted}.values())


def _walks(spec: WorldSpec) -> bool:
    return bool(spec.defaults.get("pretrain"))


def _sizes(spec: WorldSpec, level: str | None, size: str | None) -> list[tuple[int, int]]:
    if size is not None:
        return [_size(size)]
    names = spec.levels if level is None else [level]
    levels = [registry.level(spec.name, name) for name in names]
    return [(one.height, one.width) for one in levels]


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,3})x(\d{1,3})", text, re.ASCII)
    if not found:
        raise UsageError(f"--size: '{text}' is not HxW. Write rows and columns as --size 6x8.")
    height, width = int(found[1]), int(found[2])
    if not (3 <= height <= 64 and 3 <= width <= 64) or height * width < 12:
        raise UsageError(f"--size: '{text}' is out of bounds: at least 3x4 or 4x3, and at most 64x64.")
    return height, width


@contextmanager
def _bar(name: str, max_steps: int) -> Iterator[Progress | None]:
    """Steps, mean return and time on standard error, where that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}  step {task.completed:.0f}  mean return {task.fields[earned]:.1f}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(name, total=max_steps, earned=0.0)
        yield lambda steps, earned: bar.update(task, completed=steps, earned=earned)


def _page(found: dict[str, Any]) -> str:
    """The results for the reader, with the curve drawn small."""
    curve = found["curve"]
    low, high = min(curve), max(curve)
    every = max(1, len(curve) // 60)
    heights = [int((value - low) / max(high - low, 1e-9) * 7) for value in curve[::every]]
    return "\n".join(
        [
            f"{found['path']}",
            f"  sha256       {found['sha256']}",
            f"  steps        {found['steps']}, {found['seconds']} s",
            f"  mean return  {found['mean_return']:.2f} in the last 300 steps; from {low:.0f} to {high:.0f}:",
            f"               {''.join(BARS[height] for height in heights)}",
            f"  solves       {100 * found['solved']:.1f} % of mazes that it has never seen",
            f"  openness     {found['entropy']:.2f} nats; {found['gap']:.1f} between the two best logits",
        ]
    )

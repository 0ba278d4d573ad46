"""`parenting experiment`: the paper's tables, figures and claims, with our numbers beside the paper's."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from commands.said import Wrong, plainly
from experiments.catalogue import NAMES, UnknownExperiment

if TYPE_CHECKING:
    from experiments.experiment import Asked, Experiment
    from experiments.labour import Told
    from experiments.pieces import Task


def experiment(
    name: Annotated[
        str,
        typer.Argument(help=f"{', '.join(NAMES)}; all of them; or report: one HTML page of what is done."),
    ],
    scale: Annotated[
        Literal["quick", "paper"], typer.Option(help="The paper's number of trials, or a few.")
    ] = "paper",
    trials: Annotated[
        int | None, typer.Option(min=1, help="Trials, in place of the scale's. More go on from fewer.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**53 - 1)] = 0,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes.", show_default="one a core")] = None,
    device: Annotated[
        Literal["cpu", "cuda"], typer.Option(help="Where tensors are: in main memory, or on a GPU.")
    ] = "cpu",
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Dask scheduler, such as tcp://127.0.0.1:8786.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for results; what is done already lies there.")] = Path(
        "results"
    ),
) -> None:
    """Run an experiment of the paper, or go on with it, and write its page, figures and data.

    Every finished chunk of trials is stored, so a run that was stopped goes on where it was.
    `parenting experiment report` builds one HTML page of all results below --out.

    Example: parenting experiment table1 --scale quick
    """
    with plainly():
        if name == "report":
            _report(out)
            return
        asked = _asked(NAMES if name == "all" else (name,), scale, trials, seed, device)
        for one, what in asked:
            _run(one, what, out, workers or os.cpu_count() or 1, cluster)


def _report(out: Path) -> None:
    from experiments.report import BrokenResults, NoResults, report

    try:
        typer.echo(f"Written: {report(out)}")
    except (BrokenResults, NoResults, OSError) as error:
        raise Wrong(str(error)) from None


def _asked(
    names: Sequence[str],
    scale: Literal["quick", "paper"],
    trials: int | None,
    seed: int,
    device: Literal["cpu", "cuda"],
) -> list[tuple[Experiment, Asked]]:
    from experiments.catalogue import experiment
    from experiments.experiment import Asked

    try:
        found = [experiment(name) for name in names]
    except UnknownExperiment as error:
        raise Wrong(f"{error} Or: all, report.") from None
    return [(one, Asked(trials or one.trials[scale], seed, scale, device)) for one in found]


def _run(one: Experiment, asked: Asked, out: Path, workers: int, cluster: str | None) -> None:
    from experiments.labour import NoGpu, WorkersDied, see, work
    from experiments.pieces import OtherPlan, Store
    from experiments.provenance import settings
    from experiments.publish import Work, page, publish

    plan = {"experiment": one.name, "seed": asked.seed, **one.config(asked), "settings": settings()}
    tasks = [task._replace(device=asked.device) for task in one.tasks(asked)]
    try:
        if cluster is None:
            see(asked.device)
        store = Store(out / one.name / "pieces", plan, asked.scale)
        with _bar(one, tasks) as told:
            rows = work(tasks, store, workers, cluster, told)
        commits = store.commits([task.key for task in tasks])
        results = publish(one, asked, rows, out, Work(commits, store.seconds(), workers))
    except (OtherPlan, WorkersDied, NoGpu) as error:
        raise Wrong(str(error)) from None
    except OSError as error:
        raise Wrong(f"{one.name}: {error}. Look at --out and --cluster.") from None
    except KeyboardInterrupt:
        typer.echo("Stopped. The same command goes on from here.", err=True)
        raise typer.Exit(130) from None
    typer.echo(page(results, ()))


@contextmanager
def _bar(one: Experiment, tasks: Sequence[Task]) -> Iterator[Told]:
    """A progress bar with the time left, on standard error where that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _task: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn(one.name),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        whole = bar.add_task(one.name, total=sum(task.share for task in tasks))
        yield lambda task: bar.advance(whole, task.share)

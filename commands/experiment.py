"""`parenting experiment`: the paper's tables, figures and claims, with our numbers beside the paper's."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from parenting.commands.errors import UsageError, friendly_errors
from parenting.commands.options import among, folder, whole
from parenting.commands.printing import say
from parenting.experiments.registry import NAMES, UnknownExperimentError
from parenting.experiments.spec import Device, Experiment, Request, Scale

if TYPE_CHECKING:
    from parenting.experiments.runner.executor import OnDone
    from parenting.experiments.runner.store import Task

MOST = 100_000
"""Trials at most: ten times the most that the paper has."""


def experiment(
    name: Annotated[
        str,
        typer.Argument(
            help=f"{', '.join(NAMES)}; all: every experiment; or report: one HTML page of results."
        ),
    ],
    context: typer.Context,
    scale: Annotated[
        Scale,
        typer.Option(
            parser=among(get_args(Scale)),
            metavar="quick|paper",
            help="The paper's number of trials (paper), or a few (quick).",
        ),
    ] = "paper",
    trials: Annotated[
        int | None,
        typer.Option(
            parser=whole(1, MOST),
            metavar="N",
            help="Number of trials, instead of the scale's. A larger number keeps the trials that are done.",
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(parser=whole(0, 2**53 - 1), metavar="N", help="Seed of all random numbers.")
    ] = 0,
    workers: Annotated[
        int | None,
        typer.Option(
            parser=whole(1, 1000), metavar="N", help="Number of processes.", show_default="one a core"
        ),
    ] = None,
    device: Annotated[
        Device,
        typer.Option(
            parser=among(get_args(Device)),
            metavar="cpu|cuda",
            help="Device of the tensors: the CPU or a GPU.",
        ),
    ] = "cpu",
    cluster: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Address of a Dask scheduler, such as tcp://127.0.0.1:8786."),
    ] = None,
    out: Annotated[
        Path,
        typer.Option(parser=folder, metavar="FOLDER", help="Folder of the results, old and new."),
    ] = Path("results"),
    pages: Annotated[
        bool,
        typer.Option("--pages", help="With report: write the Markdown pages from the stored trials again."),
    ] = False,
) -> None:
    """Run an experiment of the paper or beyond it, or continue it, and write its page, figures and data.

    Every finished chunk of trials is stored, so an experiment that was stopped continues from there.
    `parenting experiment report` builds one HTML page of all results below --out.

    Example: parenting experiment table1 --scale quick
    """
    with friendly_errors():
        if name == "report":
            _only_out(context)
            _report(out, pages)
            return
        if pages:
            raise UsageError("--pages works with report only: parenting experiment report --pages.")
        request = _asked(NAMES if name == "all" else (name,), scale, trials, seed, device)
        for one, what in request:
            _run(one, what, out, workers or os.cpu_count() or 1, cluster)


def _only_out(context: typer.Context) -> None:
    """Refuse options that would change nothing, because no trial is run."""
    given = [one for one in context.params if _given(context, one)]
    idle = [f"--{one}" for one in given if one not in ("name", "out", "pages")]
    if idle:
        raise UsageError(f"`experiment report` accepts only --out and --pages; remove {', '.join(idle)}.")


def _given(context: typer.Context, option: str) -> bool:
    source = context.get_parameter_source(option)
    return source is not None and source.name == "COMMANDLINE"


def _report(out: Path, pages: bool) -> None:
    from parenting.experiments.reporting.html import CorruptResultsError, NoResultsError, report

    try:
        if pages:
            _pages(out)
        say(f"Written: {report(out)}")
    except (CorruptResultsError, NoResultsError) as error:
        raise UsageError(str(error)) from None
    except OSError as error:
        raise UsageError(_at(out, error)) from None


def _pages(out: Path) -> None:
    """Write every page below a folder again that has stored trials."""
    from parenting.experiments.registry import experiment
    from parenting.experiments.reporting.html import stored
    from parenting.experiments.reporting.publish import publish_again

    for results in stored(out):
        publish_again(experiment(results.name), out)
        say(f"Written: {out / results.name}.md")


def _asked(
    names: Sequence[str], scale: Scale, trials: int | None, seed: int, device: Device
) -> list[tuple[Experiment, Request]]:
    from parenting.experiments.registry import experiment

    try:
        found = [experiment(name) for name in names]
    except UnknownExperimentError as error:
        raise UsageError(f"{error} Or: all, report.") from None
    return [(one, Request(trials or one.trials[scale], seed, scale, device)) for one in found]


def _run(one: Experiment, request: Request, out: Path, workers: int, cluster: str | None) -> None:
    from parenting.experiments.reporting.markdown import page
    from parenting.experiments.reporting.publish import Work, publish
    from parenting.experiments.runner.dask_cluster import NoClusterError
    from parenting.experiments.runner.executor import NoGpuError, check_workers, work
    from parenting.experiments.runner.processes import WorkersDiedError
    from parenting.experiments.runner.provenance import settings
    from parenting.experiments.runner.store import CorruptResultError, PlanMismatchError, Store

    plan = {"experiment": one.name, "seed": request.seed, **one.config(request), "settings": settings()}
    tasks = [task._replace(device=request.device) for task in one.tasks(request)]
    try:
        check_workers(request.device, cluster)
        store = Store(out / one.name / "pieces", plan, request.scale)
        with _bar(one, tasks) as on_done:
            rows = work(tasks, store, workers, cluster, on_done)
        commits = store.commits([task.key for task in tasks])
        results = publish(one, request, rows, out, Work(commits, store.seconds(), workers))
    except (CorruptResultError, NoClusterError, NoGpuError, PlanMismatchError, WorkersDiedError) as error:
        raise UsageError(str(error)) from None
    except OSError as error:
        raise UsageError(_at(out, error)) from None
    except KeyboardInterrupt:
        say("Stopped. The same command goes on from here.", err=True)
        raise typer.Exit(130) from None
    say(page(results, ()))


def _at(out: Path, error: OSError) -> str:
    """Say which file below the folder for results failed, why, and what to do."""
    why = f"{error.strerror or error}: {error.filename or out}"
    return f"--out {out}: {why}. Make room there, or name a folder by --out that you may write to."


@contextmanager
def _bar(one: Experiment, tasks: Sequence[Task]) -> Iterator[OnDone]:
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
        whole = bar.add_task(one.name, total=sum(task.cost for task in tasks))
        yield lambda task: bar.advance(whole, task.cost)

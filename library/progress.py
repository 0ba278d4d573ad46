"""The progress of a training, for callbacks and the progress bar."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from parenting._plural import counted
from parenting.experiments.training.stop_rule import StopRule
from parenting.library.notebook import LiveLine, in_notebook

TICKS = 25
"""Ticks between two looks of a notebook's line: a kernel passes on each as a message."""


@dataclass(frozen=True)
class Progress:
    """The progress of a training after a tick.

    Attributes:
        done: Trials that are finished, or have no acceptable action left.
        trials: All trials.
        tick: Ticks of the batch in training; large runs are trained in batches, one after the other.
        queries: Answered queries of all trials.
    """

    done: int
    trials: int
    tick: int
    queries: int


@contextmanager
def bar(wanted: bool | None, trials: int, until: StopRule) -> Iterator[Callable[[Progress], None] | None]:
    """Show a bar on a terminal, and a line that moves in a notebook; None: only where there is one."""
    if wanted is not False and in_notebook():
        yield _in_notebook(LiveLine(wanted))
        return
    if not (sys.stderr.isatty() if wanted is None else wanted):
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    asking = until.kind == "queries"
    columns = (
        TextColumn("queries" if asking else "trials"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("tick {task.fields[tick]}"),
        TimeElapsedColumn(),
    )
    with Bar(*columns, console=Console(stderr=True)) as shown:
        task = shown.add_task("", total=trials * (until.number if asking else 1), tick=0)

        def show(now: Progress) -> None:
            shown.update(task, completed=now.queries if asking else now.done, tick=now.tick)

        yield show


def _in_notebook(line: LiveLine) -> Callable[[Progress], None]:
    def show(now: Progress) -> None:
        if now.tick % TICKS == 1 or now.done == now.trials:
            done = f"{now.done} of {counted(now.trials, 'trial')} done"
            line.show(f"{done}, tick {now.tick}, {counted(now.queries, 'answer')}")

    return show

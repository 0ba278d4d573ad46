"""Who does the pieces: processes of this machine, or the workers of a Dask cluster. The same code on both.

joblib hands the tasks out. A piece that comes back is stored at once. A worker that dies costs the pieces
that it had in work: they are handed out again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module

from agent.process import settle
from experiments.pieces import Row, Store, Task

TRIES = 3
"""How often in a row workers may die without one piece coming back before we give up."""

Told = Callable[[Task], None]
"""Told of every piece that is done, those of an earlier run first."""


class WorkersDied(RuntimeError):
    """Worker processes were killed again and again, often for want of memory."""


def do(task: Task) -> list[Row]:
    """Do one piece in this process."""
    settle()
    module, _, function = task.call.partition(":")
    rows: list[Row] = getattr(import_module(module), function)(**task.arguments)
    return rows


def work(
    tasks: Sequence[Task],
    store: Store,
    workers: int,
    cluster: str | None = None,
    told: Told = lambda _task: None,
) -> list[Row]:
    """Do what is not done yet, and return the rows of all pieces in the order of the tasks.

    `cluster` is the address of a Dask scheduler.

    Raises:
        WorkersDied: see there; what was done is stored.
        OSError: the cluster does not answer.
    """
    for task in tasks:
        if store.find(task) is not None:
            told(task)
    with _hands(workers, cluster):
        _until_done(tasks, store, workers, told)
    return [row for task in tasks for row in store.find(task) or ()]


def _until_done(tasks: Sequence[Task], store: Store, workers: int, told: Told) -> None:
    failed = 0
    while left := [task for task in tasks if store.find(task) is None]:
        try:
            for task, rows in _hand_out(left, workers):
                store.keep(task, rows)
                told(task)
        except _died():
            now = sum(store.find(task) is None for task in tasks)
            failed = failed + 1 if now == len(left) else 0
            if failed == TRIES:
                raise WorkersDied(
                    f"Worker processes died {TRIES} times and no piece was done. Memory may be short. "
                    "Take fewer workers or smaller chunks; what was done is stored."
                ) from None


def _hand_out(tasks: Sequence[Task], workers: int) -> Iterator[tuple[Task, list[Row]]]:
    """The dear ones first, so that none is left over at the end; each as soon as it comes back."""
    from joblib import Parallel, delayed

    ordered = sorted(tasks, key=lambda task: -task.share)
    if workers == 1 and len(ordered):
        yield from ((task, do(task)) for task in ordered)
        return
    calls = (delayed(_named)(task) for task in ordered)
    yield from Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1, pre_dispatch="all")(
        calls
    )


def _named(task: Task) -> tuple[Task, list[Row]]:
    return task, do(task)


@contextmanager
def _hands(workers: int, cluster: str | None) -> Iterator[None]:
    if cluster is None:
        yield
        return
    from dask.distributed import Client
    from joblib import parallel_config

    with Client(cluster, timeout=10), parallel_config(backend="dask"):  # type: ignore[no-untyped-call]
        yield


def _died() -> type[BaseException]:
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    died: type[BaseException] = TerminatedWorkerError
    return died

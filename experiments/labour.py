"""Who does the pieces: processes of this machine, or the workers of a Dask cluster. The same code on both.

joblib hands the tasks out. A piece that comes back is stored at once. A worker that dies costs the pieces
that it had in work: they are handed out again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from importlib import import_module

import torch

from agent.process import settle
from experiments.pieces import HIDDEN, Row, Store, Task

TRIES = 2
"""How often a worker may die over one piece, with no other in work, before we give it up."""

Told = Callable[[Task], None]
"""Told of every piece that is done, those of an earlier run first."""


class WorkersDied(RuntimeError):
    """Workers were killed again and again over some pieces, often for want of memory; the rest is done."""


class NoGpu(RuntimeError):
    """A GPU is asked for where torch sees none; the sentence says what to do."""


def see(device: str) -> None:
    """Make sure that this machine has a device.

    Raises:
        NoGpu: it has not.
    """
    if device == "cuda" and not torch.cuda.is_available():
        raise NoGpu(
            "--device cuda: torch sees no GPU here. "
            "Take --device cpu, or a machine with a GPU and a torch that is built for it."
        )


def do(task: Task, given: Sequence[Row] = ()) -> list[Row]:
    """Do one piece in this process, with all its tensors on the task's device.

    `given` are the rows of the pieces that it needs.

    Raises:
        NoGpu: this machine has not the task's device.
    """
    settle()
    see(task.device)
    module, _, function = task.call.partition(":")
    call = getattr(import_module(module), function)
    # torch's own default needs no context, which would cost time at every operation
    with nullcontext() if task.device == "cpu" else torch.device(task.device):
        rows: list[Row] = call(**task.arguments, **({"given": given} if task.needs else {}))
    return rows


def work(
    tasks: Sequence[Task],
    store: Store,
    workers: int,
    cluster: str | None = None,
    told: Told = lambda _task: None,
) -> list[Row]:
    """Do what is not done yet, and return the rows of all pieces in the order of the tasks, less HIDDEN ones.

    `cluster` is the address of a Dask scheduler.

    Raises:
        WorkersDied: see there; what was done is stored.
        NoGpu: a worker has not the device of its task.
        OSError: the cluster does not answer; or a piece is needed that no task makes.
    """
    for task in tasks:
        if store.has(task.key):
            told(task)
    with _hands(workers, cluster):
        _until_done(tasks, store, workers, told)
    return [_shown(row) for row in store.rows([task.key for task in tasks])]


def _shown(row: Row) -> Row:
    return {name: value for name, value in row.items() if not name.startswith(HIDDEN)}


def _until_done(tasks: Sequence[Task], store: Store, workers: int, told: Told) -> None:
    fatal: list[Task] = []
    while left := [task for task in tasks if task not in fatal and _ready(task, store)]:
        if not _keep(left, store, workers, told):
            fatal += _fatal(_suspects(left, store, workers), store, workers, told)
    if fatal:
        raise WorkersDied(
            f"Worker processes died {TRIES} times over {', '.join(task.key for task in fatal)}. "
            "Memory may be short. Take fewer workers; all other pieces that can be are done and stored."
        )


def _ready(task: Task, store: Store) -> bool:
    """Whether it is to be done, and all that it needs is there."""
    return not store.has(task.key) and all(map(store.has, task.needs))


def _keep(tasks: Sequence[Task], store: Store, workers: int, told: Told) -> bool:
    """Store each piece as it comes back; whether all workers lived."""
    try:
        for task, rows in _hand_out(tasks, store, workers):
            store.keep(task, rows)
            told(task)
    except _died():
        return False
    return True


def _suspects(tasks: Sequence[Task], store: Store, workers: int) -> list[Task]:
    """What may have been in work when a worker died: all workers go down with it."""
    return [task for task in _in_order(tasks) if not store.has(task.key)][: workers + 1]


def _fatal(suspects: Sequence[Task], store: Store, workers: int, told: Told) -> list[Task]:
    """Do the suspects one at a time, so that a death falls on its own piece; return those that always die."""
    return [
        task for task in suspects if not any(_keep([task], store, workers, told) for _try in range(TRIES))
    ]


def _in_order(tasks: Sequence[Task]) -> list[Task]:
    """The dear ones first, so that none is left over at the end."""
    return sorted(tasks, key=lambda task: -task.share)


def _hand_out(tasks: Sequence[Task], store: Store, workers: int) -> Iterator[tuple[Task, list[Row]]]:
    """Each as soon as it comes back."""
    from joblib import Parallel, delayed

    ordered = _in_order(tasks)
    given = {keys: store.rows(keys) for keys in {task.needs for task in ordered}}
    if workers == 1:
        yield from ((task, do(task, given[task.needs])) for task in ordered)
        return
    calls = (delayed(_numbered)(place, task, given[task.needs]) for place, task in enumerate(ordered))
    hands = Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1, pre_dispatch="all")
    yield from ((ordered[place], rows) for place, rows in hands(calls))


def _numbered(place: int, task: Task, given: Sequence[Row]) -> tuple[int, list[Row]]:
    return place, do(task, given)


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

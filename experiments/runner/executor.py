"""Run tasks on the processes of this machine or on the workers of a Dask cluster, by the same code.

joblib submits the tasks to processes (`processes.py`), and Dask to its workers (`dask_cluster.py`). The rows
of a task are stored as soon as they come back. Tasks of a worker that dies are submitted again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from importlib import import_module
from typing import NamedTuple

import torch

from parenting._process import settle
from parenting.experiments.runner.dask_cluster import reach, submit, threads
from parenting.experiments.runner.processes import WorkersDiedError, call_each
from parenting.experiments.runner.store import HIDDEN, Call, Done, Row, Store, Task

TRIES = 2
"""Deaths of a worker over one task, with no other running, after which the task is given up."""

OnDone = Callable[[Task], None]
"""Called with every task that is done, those of an earlier run first."""


class NoGpuError(RuntimeError):
    """A GPU is asked for where torch sees none; the sentence says what to do."""


class Executor(NamedTuple):
    """Something that runs tasks: processes or a cluster."""

    number: int
    died: type[BaseException]  # raised when a worker died over a task
    out: Callable[[Sequence[Call]], Iterator[Done]]  # submits tasks, and yields each once it is done


def check_workers(device: str, cluster: str | None) -> None:
    """Make sure that somebody is there to do the work, before anything is written.

    Raises:
        NoGpuError: it is this machine, and it has not the device.
        NoClusterError: it is a cluster, and it does not answer.
    """
    if cluster is None:
        check_device(device)
        return
    with reach(cluster):
        pass


def check_device(device: str) -> None:
    """Make sure that this machine has a device.

    Raises:
        NoGpuError: it has not.
    """
    if device == "cuda" and not torch.cuda.is_available():
        raise NoGpuError(
            "--device cuda: torch sees no GPU here. "
            "Use --device cpu, or a machine with a GPU and a build of torch for it."
        )


def run_task(task: Task, given: Sequence[Row] = ()) -> list[Row]:
    """Run one task in this process, with all its tensors on the task's device.

    `given` are the rows of the tasks that it needs.

    Raises:
        NoGpuError: this machine has not the task's device.
    """
    settle()
    check_device(task.device)
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
    on_done: OnDone = lambda _task: None,
) -> list[Row]:
    """Run the tasks that are not done yet; return the rows of all, in their order, without HIDDEN columns.

    `cluster` is the address of a Dask scheduler.

    Raises:
        WorkersDiedError: see there; what was done is stored.
        NoGpuError: a worker has not the device of its task.
        NoClusterError: the cluster does not answer, or has no worker, or is gone.
        PlanMismatchError: a stored result of the same name is of another task.
        CorruptResultError: a stored result cannot be read.
        OSError: a result cannot be stored; or one is needed that no task makes.
    """
    store.expect(tasks)
    for task in tasks:
        if store.has(task.key):
            on_done(task)
    with _executor(workers, cluster) as executor:
        _until_done(tasks, store, executor, on_done)
    return [_shown(row) for row in store.rows([task.key for task in tasks])]


def _shown(row: Row) -> Row:
    return {name: value for name, value in row.items() if not name.startswith(HIDDEN)}


def _until_done(tasks: Sequence[Task], store: Store, executor: Executor, on_done: OnDone) -> None:
    fatal: list[Task] = []
    while left := [task for task in tasks if task not in fatal and _ready(task, store)]:
        if not _put(left, store, executor, on_done):
            fatal += _fatal(_suspects(left, store, executor), store, executor, on_done)
    if fatal:
        raise WorkersDiedError(
            f"Worker processes died {TRIES} times over {', '.join(task.key for task in fatal)}. "
            "Memory may be short: use fewer workers. All other tasks that could run are done and stored."
        )


def _ready(task: Task, store: Store) -> bool:
    """Return whether a task is not done yet and all that it needs is there."""
    return not store.has(task.key) and all(map(store.has, task.needs))


def _put(tasks: Sequence[Task], store: Store, executor: Executor, on_done: OnDone) -> bool:
    """Store each result as it comes back; return whether all workers lived."""
    try:
        for task, rows in _submit(tasks, store, executor):
            store.put(task, rows)
            on_done(task)
    except executor.died:
        return False
    return True


def _suspects(tasks: Sequence[Task], store: Store, executor: Executor) -> list[Task]:
    """Return the tasks that may have been running when a worker died: all workers go down with it."""
    return [task for task in _in_order(tasks) if not store.has(task.key)][: executor.number + 1]


def _fatal(suspects: Sequence[Task], store: Store, executor: Executor, on_done: OnDone) -> list[Task]:
    """Run the suspects one at a time, so that a death falls on its own task; return those that always die."""
    return [
        task for task in suspects if not any(_put([task], store, executor, on_done) for _try in range(TRIES))
    ]


def _in_order(tasks: Sequence[Task]) -> list[Task]:
    """Sort the most expensive first, so that none is left over at the end."""
    return sorted(tasks, key=lambda task: -task.cost)


def _submit(tasks: Sequence[Task], store: Store, executor: Executor) -> Iterator[Done]:
    """Each as soon as it comes back."""
    ordered = _in_order(tasks)
    given = {keys: store.rows(keys) for keys in {task.needs for task in ordered}}
    return executor.out([(task, given[task.needs]) for task in ordered])


def _by_processes(workers: int, calls: Sequence[Call]) -> Iterator[Done]:
    """On this machine."""
    yield from ((calls[place][0], rows) for place, rows in call_each(run_task, calls, workers))


@contextmanager
def _executor(workers: int, cluster: str | None) -> Iterator[Executor]:
    if cluster is None:
        yield Executor(workers, WorkersDiedError, partial(_by_processes, workers))
        return
    from dask.distributed import KilledWorker

    with reach(cluster) as client:
        yield Executor(threads(client), KilledWorker, partial(submit, cluster, client, run_task))

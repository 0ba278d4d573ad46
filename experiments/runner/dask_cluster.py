"""The workers of a Dask cluster: find them by an address, and submit tasks to them.

When a worker dies, the cluster gives its tasks to other workers. (joblib's own Dask backend waits forever for
a task whose worker was killed.)
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

from parenting.experiments.runner.store import Call, Done, Row

if TYPE_CHECKING:
    from dask.distributed import Client

PATIENCE = 10
"""Seconds that a cluster has to answer, and to have a worker."""
ADDRESS = re.compile(r"((tcp|tls|ucx|ws|wss)://)?(\[[0-9a-fA-F:.%]+\]|[^\s/:@\[\]]+):[0-9]{1,5}")
EXAMPLE = "tcp://127.0.0.1:8786"


class NoClusterError(RuntimeError):
    """No cluster does the work; the sentence says why, and what to do."""

    def __init__(self, address: str, why: str) -> None:
        super().__init__(f"--cluster {address or repr(address)}: {why}")


@contextmanager
def reach(address: str) -> Iterator[Client]:
    """A cluster that has a worker, by the address of its scheduler.

    Raises:
        NoClusterError: the address is not one, nobody answers, there is no worker, or Dask is missing.
    """
    if not ADDRESS.fullmatch(address):
        raise NoClusterError(
            address, f"this is not the address of a Dask scheduler. Write one like {EXAMPLE}."
        )
    if find_spec("distributed") is None:
        raise NoClusterError(address, "Dask is not installed. Install it: pip install 'parenting[dask]'.")
    with _connected(address) as client:
        yield client


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    from dask.distributed import Client

    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # we say in a sentence what it would
    try:
        client = Client(address, timeout=PATIENCE)  # type: ignore[no-untyped-call]
    except (OSError, RuntimeError, TypeError, ValueError) as error:
        why = next(iter(str(error).splitlines()), type(error).__name__)
        raise NoClusterError(
            address, f"no Dask scheduler answers there ({why}). Start one by: dask scheduler"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except OSError:
            raise NoClusterError(address, f"it has no worker. Start one by: dask worker {address}") from None
        yield client


def threads(client: Client) -> int:
    """Return how many tasks a cluster runs at once."""
    each: dict[str, int] = client.nthreads()  # type: ignore[no-untyped-call]
    return sum(each.values())


def submit(
    address: str, client: Client, run_task: Callable[..., list[Row]], calls: Sequence[Call]
) -> Iterator[Done]:
    """Submit the tasks, and yield each as soon as it is done.

    The cluster goes on when a worker dies; the tasks that it gives up are named when all others are done.

    Raises:
        KilledWorker: workers died over a task.
        NoClusterError: the scheduler is gone.
    """
    from dask.distributed import KilledWorker, as_completed

    futures = {client.submit(run_task, *call, pure=False): call[0] for call in calls}
    killed: KilledWorker | None = None
    for future in as_completed(futures):  # type: ignore[no-untyped-call]
        try:
            rows = future.result()
        except KilledWorker as error:
            killed = error
        except CancelledError:
            raise NoClusterError(
                address,
                "the scheduler is gone. Finished tasks are stored; the same command continues from there.",
            ) from None
        else:
            yield futures[future], rows
    if killed:
        raise killed

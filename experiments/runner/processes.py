"""The processes of this machine, for experiments and for `parenting run` alike: joblib's pool.

They outlive a call, so that the next one finds them warm; all of them go down when one dies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

Result = TypeVar("Result")


class WorkersDiedError(RuntimeError):
    """Worker processes were killed, often for want of memory; the sentence says what to do."""


def call_each(
    function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], workers: int
) -> Iterator[tuple[int, Result]]:
    """Call a function with each of some arguments, on `workers` processes.

    Args:
        function: A function of a module, so that other processes can import it.
        calls: Its arguments, a tuple for each call.
        workers: Processes; with 1 the calls are made in this process, one after the other.

    Yields:
        The place of a call in `calls`, and what it returned, as soon as it is done.

    Raises:
        WorkersDiedError: a process was killed.
    """
    if workers == 1:
        yield from ((place, function(*call)) for place, call in enumerate(calls))
        return
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    numbered = (delayed(_numbered)(function, place, call) for place, call in enumerate(calls))
    pool = Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1, pre_dispatch="all")
    try:
        yield from pool(numbered)
    except TerminatedWorkerError:
        raise WorkersDiedError(
            "A worker process was killed; memory may be short. Use a smaller --workers."
        ) from None


def _numbered(function: Callable[..., Result], place: int, call: tuple[Any, ...]) -> tuple[int, Result]:
    return place, function(*call)

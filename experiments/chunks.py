"""Many trials on several cores: chunks of one size, so that results do not depend on the cores' number.

Each chunk is a batch of its own. Which chunk a trial falls into changes nothing but the last bits of its
sums: a batch of another size may add in another order (docs/architecture.md, "Batches and bits").
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import FIRST_EXCEPTION, ProcessPoolExecutor, wait
from typing import NamedTuple

import torch

from agent.birth import world_of
from agent.config import Config
from envs.rng import keys
from experiments.trials import Progress, Tally, Until, raise_trials

CHUNK = 50
LOOK_SECONDS = 0.2
"""How often the counters of the other processes are read, for the progress bar."""


class Plan(NamedTuple):
    """What every trial of a run has in common. Plain data, so that it travels between processes."""

    world: str
    level: str  # a built-in level's name, or a text
    config: Config
    seed: int
    trials: int
    until: Until
    max_ticks: int


def run(plan: Plan, workers: int, progress: Progress | None = None) -> Tally:
    """Raise all trials of a plan, on up to `workers` processes."""
    starts = range(0, plan.trials, CHUNK)
    if len(starts) == 1 or workers == 1:
        return _join([_here(plan, start, progress) for start in starts])
    return _join(list(_elsewhere(plan, list(starts), min(workers, len(starts)), progress)))


def raise_chunk(plan: Plan, start: int, progress: Progress | None = None) -> Tally:
    """The trials from `start` on, at most CHUNK. Trial i has the same keys in whichever chunk it falls."""
    world = world_of(plan.world, plan.level, plan.config)
    trial = torch.arange(start, min(start + CHUNK, plan.trials))
    return raise_trials(
        world, plan.config, keys(plan.seed, plan.trials).pick(trial), plan.until, plan.max_ticks, progress
    )


def _here(plan: Plan, start: int, progress: Progress | None) -> Tally:
    if progress is None:
        return raise_chunk(plan, start)
    return raise_chunk(plan, start, lambda finished, ticks: progress(start + finished, ticks))


def _elsewhere(plan: Plan, starts: list[int], workers: int, progress: Progress | None) -> Iterator[Tally]:
    """Every chunk in a process of a pool; their counters are read while they live."""
    context = multiprocessing.get_context("spawn")
    counters = context.Array("q", 2 * len(starts))
    with ProcessPoolExecutor(workers, context, initializer=_begin, initargs=(counters,)) as pool:
        futures = [pool.submit(_child, plan, place, start) for place, start in enumerate(starts)]
        try:
            pending = set(futures)
            while pending:
                _, pending = wait(pending, LOOK_SECONDS, FIRST_EXCEPTION)
                if progress:
                    progress(sum(counters[::2]), max(counters[1::2]))
            yield from (future.result() for future in futures)
        except BaseException:
            pool.terminate_workers() if hasattr(pool, "terminate_workers") else _terminate(pool)
            raise


def _terminate(pool: ProcessPoolExecutor) -> None:
    """End the children now, on Python older than 3.14: what they raise is of no use any more."""
    for process in list((pool._processes or {}).values()):
        process.terminate()


def _begin(counters: object) -> None:
    torch.set_num_threads(1)
    globals()["_counters"] = counters


def _child(plan: Plan, place: int, start: int) -> Tally:
    counters = globals()["_counters"]

    def note(finished: int, ticks: int) -> None:
        counters[2 * place], counters[2 * place + 1] = finished, ticks

    return raise_chunk(plan, start, note)


def _join(parts: list[Tally]) -> Tally:
    every = [part.tensors() for part in parts]
    return parts[0].map(lambda name, _tensor, _axis: torch.cat([one[name] for one in every]))

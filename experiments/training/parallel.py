"""Many trials on several cores: in chunks that depend on their number alone, not on that of the cores.

Each chunk is a batch of its own. Which chunk a trial falls into changes nothing but the last bits of its
sums: a batch of another size may add in another order (docs/architecture.md, "Batches and bits").
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import FIRST_EXCEPTION, ProcessPoolExecutor, wait
from itertools import pairwise
from typing import Any, NamedTuple

import torch

from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.agent.process import settle
from parenting.envs.rng import keys
from parenting.experiments.training.batch import Progress, Standing, Until, raise_trials
from parenting.experiments.training.outcomes import Ending, examine
from parenting.weights.store import Wanted, load

CHUNK = 100
"""Trials of a chunk at most: more would be no faster (docs/benchmarks.md). Two trials and more are two chunks
at least, so that two cores have work.
"""
FIELDS = len(Standing._fields)
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
    weights: bytes | None = None  # the file of pre-trained weights (Sec. 3.1.4)


def chunks(trials: int) -> list[range]:
    """The trials of every chunk, which depend on the number of trials alone."""
    number = max(min(2, trials), -(-trials // CHUNK))
    edges = [trials * place // number for place in range(number + 1)]
    return [range(start, end) for start, end in pairwise(edges)]


def run(plan: Plan, workers: int, progress: Progress | None = None) -> Ending:
    """Raise all trials of a plan, on up to `workers` processes."""
    every = chunks(plan.trials)
    if len(every) == 1 or workers == 1:
        return Ending.joined(list(_here(plan, every, progress)))
    return Ending.joined(list(_elsewhere(plan, every, min(workers, len(every)), progress)))


def raise_chunk(plan: Plan, chunk: range, progress: Progress | None = None) -> Ending:
    """The trials of one chunk, and how they end. Trial i has the same keys in whichever chunk it falls."""
    world = world_of(plan.world, plan.level, plan.config)
    mine = keys(plan.seed, plan.trials).pick(torch.arange(chunk.start, chunk.stop))
    weights = (
        None if plan.weights is None else load(plan.weights, Wanted(world.spec, world.height, world.width))
    )
    raised = raise_trials(world, plan.config, mine, plan.until, plan.max_ticks, progress, weights)
    return examine(world, plan.config, raised)


def _here(plan: Plan, every: list[range], progress: Progress | None) -> Iterator[Ending]:
    """One chunk after the other."""
    counters = [0] * FIELDS * len(every)
    for place, chunk in enumerate(every):

        def note(standing: Standing, place: int = place) -> None:
            _write(counters, place, standing)
            if progress:
                progress(_read(counters))

        yield raise_chunk(plan, chunk, note if progress else None)


def _elsewhere(plan: Plan, every: list[range], workers: int, progress: Progress | None) -> Iterator[Ending]:
    """Every chunk in a process of a pool; their counters are read while they live."""
    context = multiprocessing.get_context("spawn")
    counters = context.Array("q", FIELDS * len(every))
    with ProcessPoolExecutor(workers, context, initializer=_begin, initargs=(counters,)) as pool:
        futures = [pool.submit(_child, plan, place, chunk) for place, chunk in enumerate(every)]
        try:
            pending = set(futures)
            while pending:
                _, pending = wait(pending, LOOK_SECONDS, FIRST_EXCEPTION)
                if progress:
                    progress(_read(counters))
            yield from (future.result() for future in futures)
        except BaseException:
            pool.terminate_workers() if hasattr(pool, "terminate_workers") else _terminate(pool)
            raise


def _terminate(pool: ProcessPoolExecutor) -> None:
    """End the children now, on Python older than 3.14: what they raise is of no use any more."""
    for process in list((pool._processes or {}).values()):
        process.terminate()


def _begin(counters: object) -> None:
    settle()
    globals()["_counters"] = counters


def _child(plan: Plan, place: int, chunk: range) -> Ending:
    counters = globals()["_counters"]
    return raise_chunk(plan, chunk, lambda standing: _write(counters, place, standing))


def _write(counters: Any, place: int, standing: Standing) -> None:
    counters[FIELDS * place : FIELDS * (place + 1)] = standing


def _read(counters: Any) -> Standing:
    """The standing of all chunks together."""
    trials, ticks, queries = (counters[place::FIELDS] for place in range(FIELDS))
    return Standing(sum(trials), max(ticks), sum(queries))

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
from parenting.experiments.training.batch import OnProgress, Progress, StopRule, train_agents
from parenting.experiments.training.outcomes import Outcomes, examine
from parenting.weights.store import Wanted, load

CHUNK = 100
"""Trials of a chunk at most: more would be no faster (docs/benchmarks.md). Two trials and more are two chunks
at least, so that two cores have work.
"""
FIELDS = len(Progress._fields)
LOOK_SECONDS = 0.2
"""How often the counters of the other processes are read, for the progress bar."""


class Plan(NamedTuple):
    """What every trial of a run has in common. Plain data, so that it travels between processes."""

    world: str
    level: str  # a built-in level's name, or a text
    config: Config
    seed: int
    trials: int
    until: StopRule
    max_ticks: int
    weights: bytes | None = None  # the file of pre-trained weights (Sec. 3.1.4)


def chunks(trials: int) -> list[range]:
    """The trials of every chunk, which depend on the number of trials alone."""
    number = max(min(2, trials), -(-trials // CHUNK))
    edges = [trials * place // number for place in range(number + 1)]
    return [range(start, end) for start, end in pairwise(edges)]


def run(plan: Plan, workers: int, progress: OnProgress | None = None) -> Outcomes:
    """Raise all trials of a plan, on up to `workers` processes."""
    every = chunks(plan.trials)
    if len(every) == 1 or workers == 1:
        return Outcomes.joined(list(_here(plan, every, progress)))
    return Outcomes.joined(list(_elsewhere(plan, every, min(workers, len(every)), progress)))


def train_chunk(plan: Plan, chunk: range, progress: OnProgress | None = None) -> Outcomes:
    """The trials of one chunk, and how they end. Trial i has the same keys in whichever chunk it falls."""
    world = world_of(plan.world, plan.level, plan.config)
    mine = keys(plan.seed, plan.trials).pick(torch.arange(chunk.start, chunk.stop))
    weights = (
        None if plan.weights is None else load(plan.weights, Wanted(world.spec, world.height, world.width))
    )
    result = train_agents(world, plan.config, mine, plan.until, plan.max_ticks, progress, weights)
    return examine(world, plan.config, result)


def _here(plan: Plan, every: list[range], progress: OnProgress | None) -> Iterator[Outcomes]:
    """One chunk after the other."""
    counters = [0] * FIELDS * len(every)
    for place, chunk in enumerate(every):

        def note(now: Progress, place: int = place) -> None:
            _write(counters, place, now)
            if progress:
                progress(_read(counters))

        yield train_chunk(plan, chunk, note if progress else None)


def _elsewhere(
    plan: Plan, every: list[range], workers: int, progress: OnProgress | None
) -> Iterator[Outcomes]:
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


def _child(plan: Plan, place: int, chunk: range) -> Outcomes:
    counters = globals()["_counters"]
    return train_chunk(plan, chunk, lambda now: _write(counters, place, now))


def _write(counters: Any, place: int, now: Progress) -> None:
    counters[FIELDS * place : FIELDS * (place + 1)] = now


def _read(counters: Any) -> Progress:
    """The standing of all chunks together."""
    trials, ticks, queries = (counters[place::FIELDS] for place in range(FIELDS))
    return Progress(sum(trials), max(ticks), sum(queries))

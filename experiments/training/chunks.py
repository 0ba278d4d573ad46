"""Many trials on several cores: in chunks that depend on their number alone, not on that of the cores.

Each chunk is a batch of its own. Which chunk a trial falls into changes nothing but the last bits of its
sums: a batch of another size may add in another order (docs/architecture.md, "Batches and bits").
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import torch

from parenting._process import settle
from parenting.agent.beginning import FRESH, Beginning
from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.envs.rng import keys
from parenting.experiments.runner.processes import call_each
from parenting.experiments.training.batch import parent_of, train_agents
from parenting.experiments.training.counts import OnProgress, Progress, total
from parenting.experiments.training.outcomes import Outcomes, examine
from parenting.experiments.training.shared_progress import ProgressFile, watched
from parenting.experiments.training.stop_rule import StopRule
from parenting.weights.store import Wanted, load

CHUNK = 100
"""Trials of a chunk at most: more would be no faster (docs/benchmarks.md). Two trials and more are two chunks
at least, so that two cores have work.
"""


class TrainPlan(NamedTuple):
    """All that the trials of a run have in common. Plain data, so that it travels between processes."""

    world: str
    level: str  # a built-in level's name, or a text
    config: Config
    seed: int
    trials: int
    until: StopRule
    max_ticks: int
    weights: bytes | None = None  # the file of pre-trained weights (Sec. 3.1.4)
    parent: str = "scripted"  # by the grammar of `parents.grammar`
    note_optimal: bool = False  # when each policy is first optimal, also where that does not end its trial
    beginning: Beginning = FRESH  # the weights and answers of an earlier agent
    origin: Mapping[str, Any] | None = None  # the files that these are of
    history: bool = False  # whether numbers of each trial are kept after some of its ticks


def chunks(trials: int) -> list[range]:
    """Return the trials of every chunk, which depend on the number of trials alone."""
    number = max(min(2, trials), -(-trials // CHUNK))
    edges = [trials * place // number for place in range(number + 1)]
    return [range(start, end) for start, end in pairwise(edges)]


def train_in_chunks(plan: TrainPlan, workers: int, progress: OnProgress | None = None) -> Outcomes:
    """Train all trials of a plan, on up to `workers` processes of the runner's pool.

    Args:
        plan: What is trained.
        workers: Processes; the results are the same bits for any number.
        progress: Called with the progress of all chunks together: after each tick where this process trains
            them, and a few times a second where others do.

    Raises:
        WorkersDiedError: a process was killed.
    """
    every = chunks(plan.trials)
    if len(every) == 1 or workers == 1:
        return Outcomes.joined(list(_here(plan, every, progress)))
    with TemporaryDirectory(prefix="parenting-") as folder:
        shared = None if progress is None else ProgressFile.create(Path(folder) / "progress", len(every))
        calls = [(plan, chunk, shared and shared.path, place) for place, chunk in enumerate(every)]
        with watched(shared, progress):
            done = dict(call_each(_train, calls, min(workers, len(every))))
    return Outcomes.joined([done[place] for place in range(len(every))])


def train_chunk(plan: TrainPlan, chunk: range, progress: OnProgress | None = None) -> Outcomes:
    """Train the trials of one chunk. Trial i has the same keys in whichever chunk it falls."""
    world = world_of(plan.world, plan.level, plan.config)
    mine = keys(plan.seed, plan.trials).pick(torch.arange(chunk.start, chunk.stop))
    weights = (
        None if plan.weights is None else load(plan.weights, Wanted(world.spec, world.height, world.width))
    )
    result = train_agents(
        world,
        plan.config,
        mine,
        plan.until,
        max_ticks=plan.max_ticks,
        progress=progress,
        weights=weights,
        beginning=plan.beginning,
        parent=parent_of(plan.parent, world, plan.config),
        note_optimal=plan.note_optimal,
        history=plan.history,
    )
    return examine(world, plan.config, result)


def _here(plan: TrainPlan, every: Sequence[range], progress: OnProgress | None) -> Iterator[Outcomes]:
    """One chunk after the other, in this process."""
    parts = [Progress(0, 0, 0)] * len(every)
    for place, chunk in enumerate(every):

        def note(now: Progress, place: int = place) -> None:
            parts[place] = now
            if progress:
                progress(total(parts))

        yield train_chunk(plan, chunk, note if progress else None)


def _train(plan: TrainPlan, chunk: range, path: Path | None, place: int) -> Outcomes:
    """One chunk in a process of the pool; how far it is stands in the file at `path`."""
    settle()
    return train_chunk(plan, chunk, None if path is None else partial(ProgressFile(path).write, place))

"""Replay of a stored run from tick 0, by its answers and events, compared with its last checkpoint.

`parents.replay.ReplayParent` is the parent; `server.reads.record` gives it the record. It writes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.envs.gridworld import Gridworld
from parenting.parents.replay import ReplayMismatchError, ReplayParent
from parenting.server.checkpoints import load_checkpoints
from parenting.server.codec import kind_name
from parenting.server.counters import count
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.reads.record import StoredRecord, UnreadableRecordError
from parenting.server.runs import get_run
from parenting.server.snapshot import (
    INFO,
    DamagedCheckpointError,
    DivergedError,
    Snapshot,
    changed,
    initial_snapshot,
    initial_weights,
    unpack,
    versions,
)
from parenting.server.tables import Run

Progress = Callable[[int, int], None]
"""A function that is called after each tick with its number and the last one's."""


def _silent(tick: int, last: int) -> None:
    """Do nothing."""


@dataclass(frozen=True)
class Relived:
    """The result of a replay, up to the last intact checkpoint or to the first difference."""

    run: int
    tick: int  # the last one that was replayed
    answers: int
    events: int
    checkpoint: int  # the tick of the checkpoint
    parted: str | None = None  # a sentence: where the agent left its record
    differ: Sequence[str] = field(default_factory=tuple)  # pieces of state that are not equal bit for bit

    @property
    def equal(self) -> bool:
        """Return whether every query was asked again and all state is equal bit for bit."""
        return self.parted is None and not self.differ


def relive(db: Database, run_id: int, progress: Progress = _silent) -> Relived:
    """Replay a run from tick 0 to its last intact checkpoint, and compare all state with it.

    A run that a worker is raising can be replayed too: nothing changes any more up to its last checkpoint.

    Raises:
        NotFound: there is no such run, or no intact checkpoint of it.
        DivergedError: it was raised by another build of torch or with other threads, so that the bits would
            differ; or its checkpoint does not fit its config.
    """
    run = get_run(db, run_id)
    config = Config.model_validate(run.config)
    world = world_of(run.world, run.level_text, config)
    weights = initial_weights(db, run, world)
    kept = _checkpoint(db, run, world, config, weights)
    last, rows = int(kept.state.keys.tick[0]), StoredRecord(db, run_id, world, config.max_clip_length)
    lived, parent, parted = initial_snapshot(world, config, run.seed, weights), ReplayParent(rows), None
    try:
        for tick in range(1, last + 1):
            lived = _beat(world, lived, parent)
            progress(tick, last)
    except (ReplayMismatchError, UnreadableRecordError) as error:
        parted = _said(error) if isinstance(error, ReplayMismatchError) else str(error)
    differ = () if parted else differences(lived, kept)
    return Relived(run_id, parent.tick, rows.answers, rows.events, last, parted, differ)


def _beat(world: Gridworld, saved: Snapshot, parent: ReplayParent) -> Snapshot:
    state, _, answer, config = parenting.tick(world, saved.config, saved.state, parent)
    return Snapshot(state, count(world, saved.tally, answer, state), config)


def _checkpoint(db: Database, run: Run, world: Gridworld, config: Config, weights: Tensor | None) -> Snapshot:
    found = load_checkpoints(db, run.id)
    intact = [checkpoint for checkpoint in found if checkpoint.intact]
    if not intact:
        raise NotFound(
            f"Every checkpoint of run {run.id} is damaged: there is nothing to compare its record with."
            if found
            else f"Run {run.id} has no checkpoint yet: a worker writes one every two seconds of its life."
        )
    _same_build(run)
    try:
        return unpack(world, config, intact[0].blob, weights)
    except DamagedCheckpointError as error:
        raise DivergedError(f"The last checkpoint of run {run.id} is damaged: {error.message}.") from None


def _same_build(run: Run) -> None:
    here, there = versions(), run.versions or versions()
    if changed(there, here):
        raise DivergedError(
            f"Run {run.id} was trained with torch {there['torch']} and {_threads(there['threads'])}; "
            f"here are torch {here['torch']} and {_threads(here['threads'])}, which give other bits. "
            f"Install torch {there['torch']} to replay it."
        )


def _threads(number: int) -> str:
    return f"{number} thread{'' if number == 1 else 's'}"


def _said(parted: ReplayMismatchError) -> str:
    recorded, asked = kind_name(parted.recorded), kind_name(parted.asked)
    if recorded is None:
        return f"At tick {parted.tick} it asks for {asked}; the record has no question there."
    if asked is None:
        return f"At tick {parted.tick} it asks nothing; the record has a question of {recorded} there."
    return f"At tick {parted.tick} it asks another question of {asked} than the record has there."


def differences(one: Snapshot, other: Snapshot) -> list[str]:
    """Return the names of the pieces of state that are not equal bit for bit, `info` excepted."""
    wrong = [] if one.config == other.config else ["config"]
    for prefix, ours, theirs in (("", one.state, other.state), ("tally.", one.tally, other.tally)):
        expected = theirs.tensors()
        wrong += [
            prefix + name
            for name, part in ours.tensors().items()
            if not name.startswith(INFO) and not equal(part, expected[name])
        ]
    return wrong


def equal(one: Tensor, other: Tensor) -> bool:
    """Compare bit for bit, shape and dtype included: 0.0 differs from -0.0, and a NaN equals itself."""
    if one.dtype != other.dtype or one.shape != other.shape:
        return False
    return torch.equal(_bytes(one), _bytes(other))


def _bytes(tensor: Tensor) -> Tensor:
    return tensor.contiguous().reshape(-1).view(torch.uint8)

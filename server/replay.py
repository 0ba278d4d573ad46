"""Replay of a stored run from tick 0, by its answers and events, compared with its last checkpoint.

`parents.replay.ReplayParent` is the parent; `server.reads.record` gives it the record. It writes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import torch
from sqlalchemy import func, select
from torch import Tensor

from parenting._plural import counted
from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.envs.gridworld import Gridworld
from parenting.parents.replay import ReplayMismatchError, ReplayParent
from parenting.server.batches import refuse_if_of_batch
from parenting.server.begun import inherited
from parenting.server.codec import kind_name
from parenting.server.counters import count
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.notes import MachineChanged, notes
from parenting.server.reads.record import StoredRecord, UnreadableRecordError
from parenting.server.recall import Recalled, recall
from parenting.server.runs import get_run
from parenting.server.snapshot import (
    INFO,
    DivergedError,
    Snapshot,
    changed,
    first_snapshot,
    initial_weights,
    versions,
)
from parenting.server.tables import Answer, Run

Progress = Callable[[int, int], None]
"""A function that is called after each tick with its number and the last one's."""


def silent(tick: int, last: int) -> None:
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
    until: int | None = None  # the last tick before another machine went on; None: none has
    erased: int | None = None  # the tick of the first answer that was erased; None: none was

    @property
    def equal(self) -> bool:
        """Return whether every query was asked again and all state is equal bit for bit."""
        return self.parted is None and not self.differ


def relive(db: Database, run_id: int, progress: Progress = silent) -> Relived:
    """Replay a run from tick 0 to its last good checkpoint, and compare all state with it.

    A run that a worker is raising can be replayed too: nothing changes any more up to its last checkpoint.
    Where another machine went on with the run, the replay ends at the tick before: only questions are
    compared, since there is no checkpoint of that tick.

    Raises:
        NotFound: there is no such run, or no good checkpoint of it.
        DivergedError: it was raised by another machine or build of torch, so that the bits would differ.
    """
    run = get_run(db, run_id)
    config = Config.model_validate(run.config)
    world = world_of(run.world, run.level_text, config)
    weights = initial_weights(db, run, world)
    kept = _checkpoint(db, run, world, config, weights)
    until = comparable_until(db, run)
    erased = first_erased(db, run_id)
    last = min(
        tick for tick in (kept.tick, until, None if erased is None else erased - 1) if tick is not None
    )
    rows = StoredRecord(db, run_id, world, config.max_clip_length)
    rows.inherited = inherited(db, run, world, config)
    lived, parent, parted = first_snapshot(db, run, world, config, weights), ReplayParent(rows), None
    try:
        for tick in range(1, last + 1):
            lived = _beat(world, lived, parent)
            progress(tick, last)
    except (ReplayMismatchError, UnreadableRecordError) as error:
        parted = _said(error) if isinstance(error, ReplayMismatchError) else str(error)
    differ = () if parted or last < kept.tick else differences(lived, kept.saved)
    return Relived(run_id, parent.tick, rows.answers, rows.events, kept.tick, parted, differ, until, erased)


def first_erased(db: Database, run_id: int) -> int | None:
    """Return the tick of the first answer whose person's data were deleted; None if there is none.

    From there on the record does not say what the agent heard, so no replay goes further.
    """
    erased = select(func.min(Answer.applied_tick)).where(Answer.run_id == run_id, Answer.erased.is_not(None))
    with db.read() as session:
        return session.scalar(erased)


def comparable_until(db: Database, run: Run) -> int | None:
    """Return the last tick up to which bits are comparable here; None: there is no such limit.

    Raises:
        DivergedError: the run began on another machine than this.
    """
    for tick, note in notes(db, run.id):
        if isinstance(note, MachineChanged):
            _same_machine(run.id, note.before)
            return tick - 1
    _same_machine(run.id, run.versions or {})
    return None


def _beat(world: Gridworld, saved: Snapshot, parent: ReplayParent) -> Snapshot:
    state, _, answer, config, events = parenting.tick(world, saved.config, saved.state, parent)
    return Snapshot(state, count(world, saved.tally, answer, state, events), config)


def _checkpoint(db: Database, run: Run, world: Gridworld, config: Config, weights: Tensor | None) -> Recalled:
    refuse_if_of_batch(run)
    kept = recall(db, run, world, config, weights)
    if kept.sha256 is None:
        raise NotFound(
            f"Every checkpoint of run {run.id} is damaged: there is nothing to compare its record with."
            if kept.passed
            else f"Run {run.id} has no checkpoint yet: a worker writes one every two seconds of its life."
        )
    return kept


def _same_machine(run_id: int, there: dict[str, Any]) -> None:
    here = versions()
    if not changed(there, here):
        return
    if (there.get("torch"), there.get("threads")) == (here["torch"], here["threads"]):
        raise DivergedError(
            f"Run {run_id} was trained on another CPU ({_cpu(there)}); {_cpu(here)} gives other bits. "
            f"`parenting verify {run_id}` checks what is exact on every machine."
        )
    raise DivergedError(
        f"Run {run_id} was trained with torch {there.get('torch')} and {_threads(there.get('threads', 1))}; "
        f"here are torch {here['torch']} and {_threads(here['threads'])}, which give other bits. "
        f"Install torch {there.get('torch')} to replay it."
    )


def _cpu(machine: dict[str, Any]) -> str:
    return f"{machine.get('machine')}, {machine.get('cpu')}"


def _threads(number: int) -> str:
    return counted(number, "thread")


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

"""Take up a run where its last good checkpoint left it: damaged ones are passed over, and the log says so.

A checkpoint is good if its bytes are those that were written, its content can be read, it is of this run and
this tick, and no run that went on from it has departed from its record since.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from torch import Tensor

from parenting.agent.config import Config
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.server.checkpoints import StoredCheckpoint, newest_first
from parenting.server.db import Database
from parenting.server.notes import CheckpointDamaged, notes
from parenting.server.snapshot import DamagedCheckpointError, Snapshot, Written, first_snapshot, read
from parenting.server.tables import Run

CHANGED_BYTES = "its bytes are not those that were written"


@dataclass(frozen=True)
class Passed:
    """A checkpoint that was passed over, at its tick, and whether the log says so already."""

    tick: int
    note: CheckpointDamaged
    noted: bool


@dataclass(frozen=True)
class Recalled:
    """A run as its last good checkpoint left it, or at tick 0."""

    saved: Snapshot
    versions: dict[str, Any] | None  # of the machine that wrote the checkpoint
    sha256: str | None  # of the checkpoint; None: the run begins again at tick 0
    tick: int
    passed: list[Passed] = field(default_factory=list)


def recall(db: Database, run: Run, world: Gridworld, config: Config, weights: Tensor | None) -> Recalled:
    """Read the last good checkpoint of a run; without any, the run begins at tick 0 and replays its record.

    Args:
        db: The database.
        run: The run.
        world: Its world.
        config: The config that it was started with.
        weights: The pre-trained weights that it began with.
    """
    known = {note.sha256: note for _, note in notes(db, run.id) if isinstance(note, CheckpointDamaged)}
    passed = []
    for kept in newest_first(db, run.id):
        if kept.sha256 in known:
            passed.append(Passed(kept.tick, known[kept.sha256], noted=True))
            continue
        try:
            return Recalled(*_read(kept, run, world, config), kept.sha256, kept.tick, passed)
        except DamagedCheckpointError as error:
            note = CheckpointDamaged(sha256=kept.sha256, reason=error.message)
            passed.append(Passed(kept.tick, note, noted=False))
    return Recalled(first_snapshot(db, run, world, config, weights), None, None, 0, passed)


def _read(kept: StoredCheckpoint, run: Run, world: Gridworld, config: Config) -> Written:
    if not kept.intact:
        raise DamagedCheckpointError(CHANGED_BYTES)
    found = read(world, config, kept.blob)
    here = found.saved.state.keys
    if (int(here.tick[0]), int(here.seed[0])) != (kept.tick, int(keys(run.seed, 1).seed[0])):
        raise DamagedCheckpointError("it is of another run or another tick")
    return found

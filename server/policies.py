"""The present policy of a stored run as a file, from its last good checkpoint. No torch."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from parenting.agent.config import Config
from parenting.envs import registry
from parenting.envs.options import SUPERVISION
from parenting.server.batches import FOREVER
from parenting.server.checkpoints import StoredCheckpoint, newest_first
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.identity import database_id
from parenting.server.notes import CheckpointDamaged, notes
from parenting.server.runs import get_run
from parenting.server.tables import Run
from parenting.server.tensor_archive import StoredTensor, TensorArchive, UnreadableArchiveError
from parenting.weights.policy_file import pack

PARAMETERS = ("learner.params", "learner.live")
"""The name of the parameters in checkpoints, and their name in version 0.1."""


@dataclass(frozen=True)
class PolicyFile:
    """A policy's file: its name, its bytes, and what its header says."""

    name: str
    blob: bytes
    about: Mapping[str, Any]


def present_policy(db: Database, run_id: int) -> PolicyFile:
    """Return the present policy of a run, as its last good checkpoint has it.

    Raises:
        NotFound: there is no such run, or no good checkpoint of it.
        DamagedRowError: its row cannot be read.
    """
    run = get_run(db, run_id)
    if run.batch is not None:
        raise NotFound(FOREVER)
    for kept in _sound(db, run):
        try:
            return _policy(db, run, TensorArchive(kept.blob), kept.sha256)
        except UnreadableArchiveError:
            continue
    raise NotFound(
        f"Run {run_id} has no policy to take yet: there is no good checkpoint of it. "
        "A worker writes one every few seconds of its life."
    )


def _sound(db: Database, run: Run) -> Iterator[StoredCheckpoint]:
    """Yield the checkpoints whose bytes are those that were written, but for those that are passed over."""
    passed = {note.sha256 for _, note in notes(db, run.id) if isinstance(note, CheckpointDamaged)}
    return (kept for kept in newest_first(db, run.id) if kept.intact and kept.sha256 not in passed)


def _policy(db: Database, run: Run, archive: TensorArchive, sha256: str) -> PolicyFile:
    try:
        state, tally = archive.content["state"], archive.content["tally"]
        config = Config.model_validate_json(archive.content["config"])
        row = next(state[name] for name in PARAMETERS if name in state)
        count = {
            name: _number(archive, state[name]) for name in ("keys.tick", "maturity", "x.size", "x.rows")
        }
        answers = sum(_numbers(archive, tally["kinds"]))
    except (KeyError, StopIteration, TypeError, ValueError, struct.error) as error:
        raise UnreadableArchiveError(f"not the state of an agent ({error!r})") from None
    about = {
        "world": run.world,
        "levels": [run.level_text],
        "options": _options(run, config),
        "config": config.model_dump(mode="json"),
        "stage": count["maturity"],
        "trial": 0,
        "seed": run.seed,
        **({} if run.origin is None else {"origin": run.origin}),
        "source": {
            "database": database_id(db),
            "run": run.public_id,
            "parent": run.parent,
            "preset": run.preset,
            "tick": count["keys.tick"],
            "answers": answers,
            "entries": count["x.size"],
            "rows": count["x.rows"],
            "checkpoint": sha256,
            "machine": archive.content.get("versions"),
        },
    }
    name = f"policy-{run.public_id}-{count['keys.tick']}.safetensors"
    return PolicyFile(name, pack(archive.read(row), row.dtype, about), about)


def _options(run: Run, config: Config) -> dict[str, Any]:
    """Return the options of the world that differ by the config, as `agent.init.world_of` sets them."""
    known = registry.spec(run.world, run.level_text).options
    return {"supervised": SUPERVISION[config.supervised]} if "supervised" in known else {}


def _numbers(archive: TensorArchive, tensor: StoredTensor) -> tuple[int, ...]:
    return struct.unpack(f"<{tensor.size // 8}q", archive.read(tensor))


def _number(archive: TensorArchive, tensor: StoredTensor) -> int:
    return _numbers(archive, tensor)[0]

"""The whole state of an agent as bytes: tensors by name, read back without running any code."""

from __future__ import annotations

import io
import platform
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeVar

import torch
from torch import Tensor

from parenting.agent import parenting
from parenting.agent.beginning import inherit
from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.agent.query import Answer
from parenting.agent.state import AgentState, Confirmation, current_names
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.envs.struct import Struct
from parenting.server import weights
from parenting.server.begun import earlier_weights, inherited
from parenting.server.counters import Counters, no_counts
from parenting.server.db import Database
from parenting.server.errors import ServerError
from parenting.server.tables import Run
from parenting.weights.store import Wanted, load

S = TypeVar("S", bound=Struct)

INFO = "info."
"""Checkpoints leave `info` out: it records what the last tick did, and nothing in the agent reads it."""
ADDED = {"set_aside", "skips", "learner.owed"} | {
    f"confirmation.{name}" for name in Confirmation.__dataclass_fields__
}
"""Pieces that old checkpoints lack: nothing was skipped before version 0.4; 0.5 remembers more."""


class DivergedError(ServerError):
    """The agent does not do what its record says; the run was stopped."""


class DamagedCheckpointError(ServerError):
    """The content of this checkpoint cannot be used."""


class Snapshot(NamedTuple):
    """The content of a checkpoint: agent, counts, and the config as operator events have changed it."""

    state: AgentState
    tally: Counters
    config: Config


class Written(NamedTuple):
    """The content of a checkpoint: the snapshot, and the machine that wrote it."""

    saved: Snapshot
    versions: dict[str, Any]


def versions() -> dict[str, Any]:
    """Return what the bits depend on besides the record: torch's build and threads, and the machine's kind.

    `cpu` names the vector instructions that torch uses: AVX2, AVX512, DEFAULT and others.
    """
    return {
        "torch": str(torch.__version__),
        "threads": torch.get_num_threads(),
        "cpu": torch.backends.cpu.get_cpu_capability(),
        "machine": platform.machine(),
    }


def changed(before: dict[str, Any] | None, after: dict[str, Any]) -> bool:
    """Return whether bits differ between two machines. What an old version did not record counts as equal."""
    return any(after.get(name, value) != value for name, value in (before or {}).items())


def initial_weights(db: Database, run: Run, world: Gridworld) -> Tensor | None:
    """Return the weights that a run began with, earlier or pre-trained ones; None if it drew random ones.

    Raises:
        NotFound: they are not in the database, or are damaged.
    """
    if run.weights is None:
        return earlier_weights(db, run)
    return load(weights.get(db, run.weights), Wanted(world.spec, world.height, world.width))


def first_snapshot(
    db: Database, run: Run, world: Gridworld, config: Config, weights: Tensor | None
) -> Snapshot:
    """Return a stored run at tick 0, with the answers that it began with.

    Raises:
        NotFound: these are not in the database, or are damaged.
    """
    return initial_snapshot(world, config, run.seed, weights, inherited(db, run, world, config))


def initial_snapshot(
    world: Gridworld,
    config: Config,
    seed: int,
    weights: Tensor | None = None,
    answers: Sequence[Answer] = (),
) -> Snapshot:
    """Return a run at tick 0, with the weights and the answers that it begins with."""
    state = inherit(config, parenting.init(world, config, keys(seed, 1), weights), answers)
    return Snapshot(state, no_counts(), config)


def pack(saved: Snapshot) -> bytes:
    """Return a checkpoint's bytes."""
    whole = {
        "state": {name: part for name, part in saved.state.tensors().items() if not name.startswith(INFO)},
        "tally": saved.tally.tensors(),
        "config": saved.config.model_dump_json(),
        "versions": versions(),
    }
    out = io.BytesIO()
    torch.save(whole, out)
    return out.getvalue()


def unpack(world: Gridworld, config: Config, blob: bytes) -> Snapshot:
    """Read the snapshot of a checkpoint's bytes, as `read` does."""
    return read(world, config, blob).saved


def read(world: Gridworld, config: Config, blob: bytes) -> Written:
    """Read a checkpoint's bytes.

    Args:
        world: The run's world.
        config: The config that the run was started with.
        blob: What `pack` returned.

    Raises:
        DamagedCheckpointError: they are not the content of a checkpoint, or a piece is missing or has another
            shape than declared.
    """
    try:
        whole = torch.load(io.BytesIO(blob), weights_only=True)
        template = _template(world, config)
        saved = Snapshot(
            state=_restore(template.state, current_names(whole["state"])).check(),
            tally=_restore(template.tally, whole["tally"]).check(),
            config=Config.model_validate_json(whole["config"]),
        )
        return Written(saved, dict(whole["versions"]))
    except (MemoryError, OSError):
        raise
    except (
        Exception
    ) as error:  # damaged bytes cause almost any error in torch, whose advice helps nobody here
        raise DamagedCheckpointError(f"its content cannot be read ({type(error).__name__})") from error


def _template(world: Gridworld, config: Config) -> Snapshot:
    """Return a snapshot whose pieces have the right names and shapes. No weights are drawn for it."""
    return initial_snapshot(world, config, 0, torch.zeros(network_of(world).size))


def _restore(template: S, parts: dict[str, Tensor]) -> S:
    kept = {name for name, _, _ in template.leaves() if name.startswith(INFO)} | (ADDED - parts.keys())
    return template.map(lambda name, old, _axis: old if name in kept else parts[name])

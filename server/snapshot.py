"""The whole state of an agent as bytes: tensors by name, read back without running any code."""

from __future__ import annotations

import io
from typing import Any, NamedTuple, TypeVar

import torch
from torch import Tensor

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.state import AgentState, current_names
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.envs.struct import Struct
from parenting.server import weights
from parenting.server.counters import Counters, no_counts
from parenting.server.db import Database
from parenting.server.errors import ServerError
from parenting.server.tables import Run
from parenting.weights.store import Wanted, load

S = TypeVar("S", bound=Struct)

INFO = "info."
"""Checkpoints leave `info` out: it records what the last tick did, and nothing in the agent reads it."""


class DivergedError(ServerError):
    """The agent does not do what its record says; the run was stopped."""


class Snapshot(NamedTuple):
    """The content of a checkpoint: agent, counts, and the config as operator events have changed it."""

    state: AgentState
    tally: Counters
    config: Config


def versions() -> dict[str, Any]:
    """Return what the bits depend on besides the record: torch's build and its number of threads."""
    return {"torch": str(torch.__version__), "threads": torch.get_num_threads()}


def initial_weights(db: Database, run: Run, world: Gridworld) -> Tensor | None:
    """Return the pre-trained weights that a run began with; None if it drew random ones (Sec. 3.1.4).

    Raises:
        NotFound: they are not in the database, or are damaged.
    """
    if run.weights is None:
        return None
    return load(weights.get(db, run.weights), Wanted(world.spec, world.height, world.width))


def initial_snapshot(world: Gridworld, config: Config, seed: int, weights: Tensor | None = None) -> Snapshot:
    """Return a run at tick 0."""
    return Snapshot(parenting.init(world, config, keys(seed, 1), weights), no_counts(), config)


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


def unpack(world: Gridworld, config: Config, blob: bytes, weights: Tensor | None = None) -> Snapshot:
    """Read a checkpoint's bytes.

    Args:
        world: The run's world.
        config: The config that the run was started with.
        blob: What `pack` returned.
        weights: The pre-trained weights that the run began with.

    Raises:
        DivergedError: other versions of torch or another number of threads wrote them: the bits would differ.
        TypeError, KeyError: a piece is missing or has another shape than declared.
    """
    whole = torch.load(io.BytesIO(blob), weights_only=True)
    if whole["versions"] != versions():
        raise DivergedError(
            f"This run was trained with {whole['versions']}; here it would continue with {versions()}."
        )
    template = initial_snapshot(world, config, 0, weights)
    return Snapshot(
        state=_restore(template.state, current_names(whole["state"])).check(),
        tally=_restore(template.tally, whole["tally"]).check(),
        config=Config.model_validate_json(whole["config"]),
    )


def _restore(template: S, parts: dict[str, Tensor]) -> S:
    return template.map(lambda name, old, _axis: old if name.startswith(INFO) else parts[name])

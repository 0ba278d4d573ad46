"""The earlier policy and answers that a stored run began with, as tensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.query import Answer
from parenting.envs.gridworld import Gridworld
from parenting.server import weights
from parenting.server.beginnings import parameters, tensors
from parenting.server.db import Database
from parenting.server.tables import Run
from parenting.weights.answers_file import unpack_answers
from parenting.weights.policy_file import unpack

STORED = "policy or answers that the run began with,"


def earlier_weights(db: Database, run: Run) -> Tensor | None:
    """Return the weights of the policy that a run began with; None without any.

    Raises:
        NotFound: they are not in the database, or are damaged.
    """
    policy = _part(run, "policy")
    return None if policy is None else parameters(unpack(weights.get(db, policy["stored"], STORED)))


def inherited(db: Database, run: Run, world: Gridworld, config: Config) -> Sequence[Answer]:
    """Return the answers that X of a run began with.

    Raises:
        NotFound: they are not in the database, or are damaged.
    """
    answers = _part(run, "answers")
    if answers is None:
        return ()
    rows = unpack_answers(weights.get(db, answers["stored"], STORED))
    return tensors(rows, world, config)


def _part(run: Run, name: str) -> dict[str, Any] | None:
    found: dict[str, Any] | None = (run.origin or {}).get(name)
    return found

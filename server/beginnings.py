"""Earlier policies and answers as the tensors that agents begin with."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from parenting.agent.beginning import Beginning
from parenting.agent.config import Config
from parenting.agent.query import Answer
from parenting.envs.gridworld import Gridworld
from parenting.server.codec import CHOICES, decode
from parenting.weights.answers_file import Heard
from parenting.weights.origin import Origin
from parenting.weights.policy_file import StoredPolicy


def beginning(origin: Origin, world: Gridworld, config: Config) -> Beginning:
    """Return what agents of a batch begin with, from files that fit."""
    own = None if origin.policy is None else parameters(origin.policy)
    rows = () if origin.answers is None else origin.answers.rows
    return Beginning(own, tensors(rows, world, config))


def parameters(policy: StoredPolicy) -> Tensor:
    """Return the parameters of a policy, one flat row [P]."""
    return torch.frombuffer(bytearray(policy.data), dtype=getattr(torch, policy.dtype))


def tensors(rows: Sequence[Heard], world: Gridworld, config: Config) -> tuple[Answer, ...]:
    """Return the answers of an export as the agent hears them."""
    return tuple(_answer(row, world, config.max_clip_length) for row in rows)


def _answer(row: Heard, world: Gridworld, stages: int) -> Answer:
    clips = row.model_dump(include={"left", "right"})
    query = decode(world, stages, row.kind, row.maturity, clips, row.votes)
    return Answer(query=query, choice=torch.tensor([int(CHOICES[row.choice])]))

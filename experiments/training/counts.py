"""Counts of trials in training, and the progress of a batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from parenting.envs.struct import Struct


class Progress(NamedTuple):
    """The progress of a batch."""

    trials: int  # those that are done: finished, or stuck
    ticks: int
    queries: int  # answered, of each trial at most as many as its goal asks for


OnProgress = Callable[[Progress], None]


class Counts(Struct):
    """Counts of each trial; M is the number of stages."""

    deaths: Int64[Tensor, "N"]  # unsafe steps (docs/paper.md, "Unsafe")
    guidance: Int64[Tensor, "N"]  # answered guidance queries, redraws included
    preference: Int64[Tensor, "N"]
    queries: Int64[Tensor, "N M"]  # answered queries of either kind, by the stage that they belong to
    ticks: Int64[Tensor, "N"]
    maturity: Int64[Tensor, "N"]  # the stage at the end
    optimal: Bool[Tensor, "N"]  # the argmax policy at the end
    finished: Bool[Tensor, "N"]
    stuck: Bool[Tensor, "N"]  # no acceptable action: it would wait without end
    optimal_at: Int64[Tensor, "N"]  # the tick at which the policy was first optimal; 0: never, or not noted
    optimal_deaths: Int64[Tensor, "N"]  # the deaths until then
    optimal_queries: Int64[Tensor, "N"]  # the answered queries until then

    @property
    def done(self) -> Bool[Tensor, "N"]:
        """Nothing more happens to it."""
        return self.finished | self.stuck


def no_counts(trials: int, stages: int = 1) -> Counts:
    """Nothing counted yet."""
    zero, false = torch.zeros(trials, dtype=torch.int64), torch.zeros(trials, dtype=torch.bool)
    return Counts(
        deaths=zero,
        guidance=zero,
        preference=zero,
        queries=torch.zeros(trials, stages, dtype=torch.int64),
        ticks=zero,
        maturity=zero + 1,
        optimal=false,
        finished=false,
        stuck=false,
        optimal_at=zero,
        optimal_deaths=zero,
        optimal_queries=zero,
    )


def total(parts: Sequence[Progress]) -> Progress:
    """Return the progress of several batches together: trials and queries of all, ticks of the furthest."""
    trials, ticks, queries = zip(*parts, strict=True)
    return Progress(sum(trials), max(ticks), sum(queries))

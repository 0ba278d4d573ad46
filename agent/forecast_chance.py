"""The probabilities of the forecasts that guidance shows (Sec. 2.1), where a world tells its chance."""

from __future__ import annotations

import torch

from parenting.agent.query import Query, QueryKind
from parenting.envs.gridworld import Gridworld

DIGITS = 6
"""Digits of a probability: it is stored as text."""


def forecast_chances(world: Gridworld, query: Query, trial: int = 0) -> tuple[float, float] | None:
    """Return how probable the outcome on each side is; None where nothing is left to chance, or is not said.

    Args:
        world: The world of the query.
        query: The queries of N trials.
        trial: The trial whose query is meant.
    """
    if world.branches == 1 or int(query.kind[trial]) != QueryKind.GUIDANCE:
        return None
    one = query.pick(torch.tensor([trial], device=query.kind.device))
    states = world.beginnings().pick(torch.zeros_like(one.level))
    left, right = (
        states.replace(
            board=one.board[:, side, 0],
            agent=one.agent[:, side, 0].long(),
            box=one.box[:, side, 0].long(),
            level=one.level,
        )
        for side in (0, 1)
    )
    said = [
        round(float(world.likelihood(state, one.action[:, side, 0].long())), DIGITS)
        for side, state in enumerate((left, right))
    ]
    return None if said == [1.0, 1.0] else (said[0], said[1])

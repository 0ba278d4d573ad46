"""Relabelling: a pair whose answer is reused is asked about again with the chance that it is wrong (ours).

Answers of parents who slip are wrong at times, and an agent that never asks twice keeps them. To ask again
about what was answered is known as relabelling, or repeated labelling (Sheng, Provost and Ipeirotis, Get
Another Label?, KDD 2008). Here the votes of all visits count. The policy's opinion does not, because it was
trained on these very votes.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from parenting.agent import confirmation, memory
from parenting.agent.candidates import Found
from parenting.agent.dataset import NEITHER
from parenting.agent.state import PAIRS, AgentState
from parenting.envs.rng import Stream

_PAIRS = torch.tensor(PAIRS)


def doubt(state: AgentState, observation: Tensor, found: Found) -> Found:
    """Ask about the most doubtful pair, with the chance that it is wrong, in place of a reused move.

    Only pairs that bear on the move are doubted: those that it belongs to, and those refused by *neither*.

    Args:
        state: N agents; pairs refused or skipped in this pause are not asked about.
        observation: The present state of each, as observed.
        found: What there is to ask, or the move that earlier answers decide for.

    Returns:
        The same, but not decided where a pair is doubted.
    """
    told = memory.said(state.x, observation)
    moves = _PAIRS.to(told.device)
    bearing = (moves == found.move[:, None, None]).any(2) | _refused(told)
    wrong = chance_wrong(told, confirmation.error_rate(state.confirmation))
    chance, pair = wrong.masked_fill(~(bearing & state.free_pairs), 0.0).max(1)
    doubted = found.decided & (state.keys.uniform(Stream.RELABEL) < chance)
    return Found(
        pair=torch.where(doubted[:, None], moves[pair], found.pair),
        decided=found.decided & ~doubted,
        move=found.move,
    )


def chance_wrong(told: Int64[Tensor, "N 6 4"], rate: Float64[Tensor, "N"]) -> Float64[Tensor, "N 6"]:
    """Return the chance that the leading answer about each pair is wrong; 0 where there is none.

    Args:
        told: How often guidance gave each answer about each pair (`memory.said`).
        rate: The parent's error rate.
    """
    counts = (
        told.flatten(0, 1).sort(1, descending=True).values
    )  # so that pairs alike in votes have equal chances
    posterior = confirmation.posterior(
        torch.zeros(len(counts), dtype=torch.float64, device=told.device), counts, rate.repeat_interleave(6)
    )
    return (1 - posterior.max(1).values).view(-1, 6).masked_fill(told.sum(2) == 0, 0.0)


def _refused(told: Int64[Tensor, "N 6 4"]) -> Bool[Tensor, "N 6"]:
    """Return the pairs of which *neither* is the leading answer."""
    return (told.argmax(2) == NEITHER) & (told[:, :, NEITHER] > 0)

"""The two moves that guidance asks about (Sec. 2.1), and moves that earlier answers decide for (ours)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Float, Float64, Int64
from torch import Tensor

from parenting.agent import memory
from parenting.agent.config import Config
from parenting.agent.memory import Memory
from parenting.agent.state import PAIRS, AgentState
from parenting.envs.rng import Stream, gumbel

LAST = 1e6
"""Less likely than any move by this: proposed if nothing else is left."""
_RANKED = torch.tensor(PAIRS)  # pairs of ranks in their order: the two best first


class Found(NamedTuple):
    """The question where the agent pauses, or the move that makes it needless."""

    pair: Int64[Tensor, "N 2"]  # the two moves to ask about
    decided: Bool[Tensor, "N"]  # earlier answers decide for a move
    move: Int64[Tensor, "N"]  # which; any elsewhere


def choose(config: Config, state: AgentState, observation: Tensor, logits: Float[Tensor, "N 4"]) -> Found:
    """Choose the two moves to ask about: 2 distinct draws from pi, or by what earlier guidance has told.

    Args:
        config: The hyperparameters; `fresh_pairs`, `reuse_answers` and `learn_refusals` are read.
        state: N agents: moves refused and pairs skipped in this pause are not proposed.
        observation: The present state of each, as observed.
        logits: Of the policy there.

    Returns:
        Pairs and decided moves, for all trials, whether they pause or not.
    """
    noise = gumbel(state.keys.uniform(Stream.CANDIDATES, 4))
    perturbed = logits.double() + noise
    if not config.remembers:
        pair = _draw(state, perturbed)
        return Found(pair, torch.zeros_like(state.waiting), pair[:, 0])
    known = memory.recall(state.x, observation, memory.rounds(config))
    refused = known.refused & config.learn_refusals
    pair = _draw(state, perturbed - LAST * refused)
    move, decided = _implied(known, pair)
    if config.fresh_pairs:
        fresh, new = _fresh(known, state, ~state.refused & ~refused, logits)
        move, pair = fresh[:, 0], torch.where(new[:, None], fresh, pair)
        decided = ~new
    every = torch.arange(len(move), device=move.device)
    acceptable = known.approved[every, move] & ~state.refused[every, move]
    return Found(pair, decided & acceptable & config.reuse_answers, move)


def _draw(state: AgentState, perturbed: Float64[Tensor, "N 4"]) -> Int64[Tensor, "N 2"]:
    """Return the two best actions, or of the pairs that were not skipped the best by its better action."""
    perturbed = perturbed.masked_fill(state.refused, -torch.inf)
    best = perturbed.topk(2, dim=1).indices
    if not bool(state.set_aside.any()):
        return best
    ranked = perturbed.sort(dim=1, descending=True).indices
    pairs = ranked[:, _RANKED.to(ranked.device)]  # [N, 6, 2], the best first
    moves = torch.nn.functional.one_hot(pairs, 4).sum(2) > 0  # [N, 6, 4]
    free = (moves[:, :, _RANKED.to(ranked.device)].all(3) & state.free_pairs[:, None]).any(2)  # [N, 6]
    first = free.int().argmax(1)
    return torch.where(state.set_aside.any(1)[:, None], pairs[torch.arange(len(first)), first], best)


def _implied(known: Memory, pair: Int64[Tensor, "N 2"]) -> tuple[Int64[Tensor, "N"], Bool[Tensor, "N"]]:
    """Return the winner of a pair whose answer follows, and where it does; a tie goes to the likelier."""
    every = torch.arange(len(pair), device=pair.device)
    first, second = pair.unbind(1)
    move = torch.where(known.better[every, second, first], second, first)
    return move, known.compared[every, first, second]


def _fresh(
    known: Memory, state: AgentState, proposed: Bool[Tensor, "N 4"], logits: Float[Tensor, "N 4"]
) -> tuple[Int64[Tensor, "N 2"], Bool[Tensor, "N"]]:
    """Return the likeliest move that none beats and the likeliest not compared with it, if there is one.

    Elsewhere the first of them is the best of those proposed, as far as the answers tell.
    """
    unbeaten = proposed & ~known.worse(proposed)
    likely = logits.double().masked_fill(~unbeaten, -torch.inf)
    best = likely.argmax(1)
    every = torch.arange(len(best), device=best.device)
    fresh = unbeaten & ~known.compared[every, best] & memory.both_ways(state.free_pairs)[every, best]
    against = likely.masked_fill(~fresh, -torch.inf).argmax(1)
    return torch.stack((best, against), 1), fresh.any(1)

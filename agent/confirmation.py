"""Confirmation: an answer to guidance moves the agent once it is likely enough to be right (ours; `confirm`).

The votes on a pair of actions in one pause belong to four classes. Each class has a posterior: its prior is
the policy's opinion of the two actions, and a vote is a slip with the error rate e of the parent, which is
estimated from how often repeats were overruled. Votes find slips, which are drawn again each time; they
cannot find a misconception, which is the same wrong answer each time.
"""

from __future__ import annotations

from enum import IntEnum

import torch
import torch.nn.functional as F
from jaxtyping import Bool, Float, Float64, Int64
from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.query import Answer, Choice, Query
from parenting.agent.state import MOST_VOTES, PAIRS, AgentState, Confirmation

PRIOR_SLIPS, PRIOR_VOTES = 1.0, 10.0
"""The error rate before any repeat: Beta(1, 9), mean 0.1. Its 95 % interval, 0.3 to 34 %, holds what careful
and careless parents do, and ten repeats weigh as much as it does: an agent seldom hears many more."""
HIGHEST_RATE = 0.5
"""A vote counts as right half of the time at least, so that no estimate turns its meaning around."""
OPINION = 2.0
"""The policy's opinion counts for this much log odds at most, less than a vote: it decides nothing alone."""
_PAIRS = torch.tensor(PAIRS)


class Verdict(IntEnum):
    """The meaning of a vote on a pair; at equal posteriors the first leads, which moves nobody."""

    NEITHER = 0
    LOWER = 1  # the action of the lower number is better
    HIGHER = 2
    EITHER = 3


def tally(
    config: Config, state: AgentState, logits: Float[Tensor, "N 4"], answer: Answer, told: Bool[Tensor, "N"]
) -> tuple[AgentState, Int64[Tensor, "N"], Bool[Tensor, "N"]]:
    """Count the votes of this tick, and decide each pair that is confirmed or has had the most votes.

    Args:
        config: The hyperparameters; `confirm` is read.
        state: N agents.
        logits: Of each trial's policy, where the agent stands.
        answer: What the parents say.
        told: Where an answer belongs to the pause that the agent is in.

    Returns:
        The agents; the decisions as answers to their questions, `Choice.NONE` where the pair has to be asked
        again; and where there is something to resolve: a late answer to a pair that was refused is not.
    """
    query, kept = answer.query, state.confirmation
    pair, lower_left = pair_of(query), _lower_left(query)
    told = told & ~(pair & refused_pairs(state)).any(1)
    voting = told & answer.judges
    heard = _place_vote(kept.votes[pair], _verdict(answer.choice, lower_left))
    winner, sure = decide(config.confirm, _gap(logits, query), heard, error_rate(kept))
    decided = voting & sure
    kept = kept.replace(
        votes=torch.where((voting[:, None] & pair)[:, :, None], heard[:, None], kept.votes),
        mirrored=torch.where(voting[:, None] & pair, ~lower_left[:, None], kept.mirrored),
    )
    kept = _count_repeats(kept, heard, winner, decided.long())
    over = decided & (winner != Verdict.NEITHER)
    kept = kept.replace(votes=kept.votes.masked_fill(over[:, None, None], 0))
    decision = torch.where(sure, _choice(winner, lower_left), int(Choice.NONE))
    return state.replace(confirmation=kept), torch.where(voting, decision, answer.choice), told


def decide(
    bound: float,
    gap: Float64[Tensor, "n"],
    votes: Int64[Tensor, "n V"],
    rate: Float64[Tensor, "n"],
) -> tuple[Int64[Tensor, "n"], Bool[Tensor, "n"]]:
    """Return the verdict of the greatest posterior, and where it is decided.

    Args:
        bound: The posterior that confirms.
        gap: The policy's logit of the lower action less that of the higher one.
        votes: 1 + the verdict of each vote, 0 for none.
        rate: The parent's error rate. A slip is any of the three other verdicts.
    """
    counts = F.one_hot(votes, 5).sum(1)[:, 1:]
    best, winner = posterior(gap, counts, rate).max(1)
    return winner, (best >= bound) | (counts.sum(1) >= MOST_VOTES)


def posterior(
    gap: Float64[Tensor, "n"], counts: Int64[Tensor, "n 4"], rate: Float64[Tensor, "n"]
) -> Float64[Tensor, "n 4"]:
    """Return the probability of each verdict on a pair, given how many votes each has had.

    Gap and rate are those of `decide`; at a gap of 0 all verdicts have the same prior.
    """
    opinion = gap.clamp(-OPINION, OPINION)
    flat = torch.full_like(gap, 0.25)
    prior = torch.stack((flat, opinion.sigmoid() / 2, (-opinion).sigmoid() / 2, flat), 1)
    number = counts.sum(1, keepdim=True)
    slip = (rate / 3).log()[:, None]
    return (prior.log() + counts * (1 - rate).log()[:, None] + (number - counts) * slip).softmax(1)


def error_rate(kept: Confirmation) -> Float64[Tensor, "N"]:
    """The parent's error rate: the posterior mean over the repeats that a decision overruled.

    First votes are left out: a decision after one vote agrees with itself.
    """
    return ((PRIOR_SLIPS + kept.dissents) / (PRIOR_VOTES + kept.repeats.double())).clamp_max(HIGHEST_RATE)


def unsettled(state: AgentState) -> Bool[Tensor, "N 6"]:
    """The pairs that have votes in this pause and are not decided, as in `PAIRS`."""
    return (state.confirmation.votes > 0).any(2) & state.free_pairs


def mirror(state: AgentState, sides: Int64[Tensor, "N 2"]) -> tuple[Int64[Tensor, "N 2"], Int64[Tensor, "N"]]:
    """Put an unsettled pair in the place of a drawn one, its sides swapped since it was last answered.

    Returns:
        The sides, and the number of votes on each pair before.
    """
    waiting = unsettled(state)
    again, index = waiting.any(1), waiting.int().argmax(1)
    every = torch.arange(len(index), device=index.device)
    pair = _PAIRS.to(index.device)[index]
    swapped = torch.where(state.confirmation.mirrored[every, index, None], pair, pair.flip(1))
    number = (state.confirmation.votes[every, index] > 0).sum(1)
    return torch.where(again[:, None], swapped, sides), number * again


def begin(state: AgentState, pausing: Bool[Tensor, "N"]) -> AgentState:
    """Remember the tick at which a pause begins."""
    began = torch.where(pausing, state.keys.tick, state.confirmation.began)
    return state.replace(confirmation=state.confirmation.replace(began=began))


def is_vote(state: AgentState, answer: Answer, asked: int) -> Bool[Tensor, "N"]:
    """Return where an answer to a question of tick `asked` is among the votes of this pause."""
    query = answer.query
    votes = state.confirmation.votes[pair_of(query)].gather(1, query.votes[:, None]).squeeze(1)
    said = 1 + _verdict(answer.choice, _lower_left(query))
    return (votes == said) & answer.judges & (asked >= state.confirmation.began)


def take_back(state: AgentState, query: Query, where: Bool[Tensor, "N"]) -> AgentState:
    """Remove the vote that answered a query; a refusal that it took part in is counted no more."""
    kept, pair = state.confirmation, pair_of(query)
    refused = where & (pair & refused_pairs(state)).any(1)
    neither = torch.full_like(query.votes, int(Verdict.NEITHER))
    kept = _count_repeats(kept, kept.votes[pair], neither, -refused.long())
    vote = F.one_hot(query.votes, MOST_VOTES).bool()[:, None] & pair[:, :, None]
    votes = kept.votes.masked_fill(vote & where[:, None, None], 0)
    return state.replace(confirmation=kept.replace(votes=votes))


def forget(kept: Confirmation) -> Confirmation:
    """No votes in any trial: the pauses have ended."""
    return kept.replace(votes=torch.zeros_like(kept.votes))


def pair_of(query: Query) -> Bool[Tensor, "N 6"]:
    """Return the pair of moves that a query asks about, as in `PAIRS`: exactly one of a trial's."""
    first = query.action[:, :, 0]
    lower, higher = first.amin(1), first.amax(1)
    pairs = _PAIRS.to(first.device)
    found = (pairs == torch.stack((lower, higher), 1)[:, None]).all(2)
    found[:, 0] |= lower == higher  # where nothing is asked
    return found


def refused_pairs(state: AgentState) -> Bool[Tensor, "N 6"]:
    """The pairs of which both actions were refused in this pause, as in `PAIRS`."""
    return state.refused[:, _PAIRS.to(state.refused.device)].all(2)


def _lower_left(query: Query) -> Bool[Tensor, "N"]:
    """Return where the action of the lower number stands left."""
    return query.action[:, 0, 0] < query.action[:, 1, 0]


def _gap(logits: Float[Tensor, "N 4"], query: Query) -> Float64[Tensor, "N"]:
    """Return the logit of the pair's lower action less that of its higher one."""
    asked = logits.double().gather(1, query.action[:, :, 0])
    return torch.where(_lower_left(query), asked[:, 0] - asked[:, 1], asked[:, 1] - asked[:, 0])


def _place_vote(votes: Int64[Tensor, "N V"], verdict: Int64[Tensor, "N"]) -> Int64[Tensor, "N V"]:
    """Put a vote in the first empty place: behind the others, or where one was taken back."""
    place = (votes == 0).int().argmax(1)
    return votes.scatter(1, place[:, None], 1 + verdict[:, None])


def _count_repeats(kept: Confirmation, votes: Tensor, winner: Tensor, times: Tensor) -> Confirmation:
    """Count the votes after the first one of each pair, and those that differ from the decision."""
    later = votes[:, 1:]
    dissenting = (later > 0) & (later != 1 + winner[:, None])
    return kept.replace(
        repeats=kept.repeats + times * (later > 0).sum(1),
        dissents=kept.dissents + times * dissenting.sum(1),
    )


def _verdict(choice: Int64[Tensor, "N"], lower_left: Bool[Tensor, "N"]) -> Int64[Tensor, "N"]:
    """Return what an answer says of its pair; where there is none, `Verdict.NEITHER`."""
    verdict = torch.full_like(choice, int(Verdict.NEITHER))
    verdict = torch.where(choice == Choice.EITHER, int(Verdict.EITHER), verdict)
    sided = (choice == Choice.LEFT) | (choice == Choice.RIGHT)
    lower = (choice == Choice.LEFT) == lower_left
    return torch.where(sided, torch.where(lower, int(Verdict.LOWER), int(Verdict.HIGHER)), verdict)


def _choice(verdict: Int64[Tensor, "N"], lower_left: Bool[Tensor, "N"]) -> Int64[Tensor, "N"]:
    """Return a verdict as an answer to a question with these sides."""
    left = (verdict == Verdict.LOWER) == lower_left
    sided = torch.where(left, int(Choice.LEFT), int(Choice.RIGHT))
    choice = torch.where(verdict == Verdict.EITHER, int(Choice.EITHER), sided)
    return torch.where(verdict == Verdict.NEITHER, int(Choice.NEITHER), choice)

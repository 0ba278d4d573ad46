"""The consensus of several parents who answer the same questions: majority, one trust each, Dawid and Skene.

The right answer to each question is hidden, and so is how far each parent is to be trusted. EM (Dawid & Skene
1979) finds both from the votes alone: a parent is trusted who agrees with those who are trusted. The paper
has one parent; all of this is ours. Votes are counts: a parent may answer a question more than once, or not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from jaxtyping import Float64
from torch import Tensor

ROUNDS = 20
"""Rounds of EM for each question; the estimates of the panels hardly change after ten."""
RIGHT, WRONG = 4.0, 2.0
"""The beginning of a parent's trust: answers that count as right and wrong before the first one."""
COMMON = 1.0
"""Questions of each right answer that are taken to have come before the first one."""
LEAST = 1e-10
"""No probability is taken to be smaller."""

Votes = Float64[Tensor, "N Q K C"]
"""For N trials, Q questions, K parents and C possible answers: how often each was given."""
Beliefs = Float64[Tensor, "N Q C"]
"""The probability of each answer to be the right one, for each question."""


class Estimate(NamedTuple):
    """The result of EM."""

    right: Beliefs
    common: Float64[Tensor, "N C"]  # the share of questions with each right answer
    told: Float64[Tensor, "N K C C"]  # given the right answer, the chance of each that a parent gives

    @property
    def trust(self) -> Float64[Tensor, "N K"]:
        """The accuracy of each parent, over the questions as they come."""
        return (self.told.diagonal(dim1=-2, dim2=-1) * self.common[:, None]).sum(-1)


Consensus = Callable[[Votes, Beliefs | None], Estimate]
"""Finds the right answers from votes, perhaps with an opinion on each question beforehand."""


def majority(votes: Votes, opinion: Beliefs | None = None) -> Estimate:
    """The share of the votes; what Dawid and Skene begin from. All parents are trusted alike."""
    right = _shares(votes.sum(2))
    return Estimate(right, _shares(_asked(votes, right).sum(1)), _confusion(votes, right))


def dawid_skene(votes: Votes, opinion: Beliefs | None = None) -> Estimate:
    """Dawid & Skene 1979: each parent has a table of errors, estimated by maximum likelihood."""
    found = majority(votes)
    for _ in range(ROUNDS):
        right = _posterior(votes, found.common[:, None], found.told)
        found = Estimate(right, _shares(_asked(votes, right).sum(1)), _confusion(votes, right))
    return found


def trusted(votes: Votes, opinion: Beliefs | None = None) -> Estimate:
    """EM with one trust a parent: the chance to be right, whatever the question; all errors are alike.

    Trust begins above one half, so that of the two solutions that exchange right and wrong EM finds the one
    where most parents mean well. `opinion` multiplies the probability of each answer before the votes.
    """
    found = majority(votes)
    for _ in range(ROUNDS):
        told, common = _one_trust(votes, found.right), _symmetric(_asked(votes, found.right).sum(1) + COMMON)
        before = common[:, None] if opinion is None else _shares(common[:, None] * opinion)
        found = Estimate(_posterior(votes, before, told), common, told)
    return found


def _one_trust(votes: Votes, right: Beliefs) -> Float64[Tensor, "N K C C"]:
    """The maximum of each parent's accuracy under a Beta prior, spread over the table of its errors."""
    answers = votes.shape[-1]
    hits, given = (votes * right[:, :, None]).sum((1, 3)), votes.sum((1, 3))
    accuracy = (hits + RIGHT) / (given + RIGHT + WRONG)
    same = torch.eye(answers, dtype=votes.dtype, device=votes.device)
    wrong = (1 - accuracy) / (answers - 1)
    return accuracy[..., None, None] * same + wrong[..., None, None] * (1 - same)


def _symmetric(counts: Float64[Tensor, "N C"]) -> Float64[Tensor, "N C"]:
    """Shares in which the first two answers are as common: a question's sides are drawn by a coin."""
    sides = counts[:, :2].mean(1, keepdim=True).expand(-1, 2)
    return _shares(torch.cat((sides, counts[:, 2:]), 1))


def _asked(votes: Votes, right: Beliefs) -> Beliefs:
    """The beliefs on questions that somebody has answered, and zero elsewhere."""
    return right * (votes.sum((2, 3)) > 0)[..., None]


def _confusion(votes: Votes, right: Beliefs) -> Float64[Tensor, "N K C C"]:
    return _shares(torch.einsum("nqt,nqkc->nktc", right, votes))


def _posterior(votes: Votes, before: Tensor, told: Float64[Tensor, "N K C C"]) -> Beliefs:
    likelihood = torch.einsum("nqkc,nktc->nqt", votes, told.clamp_min(LEAST).log())
    return (likelihood + before.clamp_min(LEAST).log()).softmax(-1)


def _shares(counts: Tensor) -> Tensor:
    """Divided by their sum; where it is zero, all alike."""
    total = counts.sum(-1, keepdim=True)
    return torch.where(total > 0, counts / total.clamp_min(LEAST), 1 / counts.shape[-1])

"""The memory of guidance: no question is asked whose answer follows from earlier ones (ours).

X keeps, beside the rows that Eq. (2) needs, how often guidance gave each answer about each pair of moves in
each state. It is filled with X and rebuilt with it, so that it falls with an answer that is undone. Answers
about clips do not enter: a clip that was preferred may still be deadly.
"""

from __future__ import annotations

from itertools import permutations
from typing import NamedTuple

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from parenting.agent import dataset
from parenting.agent.config import Config
from parenting.agent.dataset import EITHER, FIRST, NEITHER, SECOND, Dataset, Entry
from parenting.agent.query import Choice
from parenting.agent.state import PAIRS
from parenting.envs.fingerprint import fingerprint

_PAIRS = torch.tensor(PAIRS)
_FIRST, _SECOND = _PAIRS.unbind(1)


def remember(
    config: Config, x: Dataset, entry: Entry, choice: Int64[Tensor, "N"], told: Bool[Tensor, "N"]
) -> Dataset:
    """X with these answers to guidance remembered. In place.

    With `learn_refusals`, a move that was approved counts as better than one that was refused in its state,
    as one entry of Eq. (2), unless the two were compared.

    Args:
        config: The hyperparameters; `learn_refusals` is read.
        x: X of N trials, with the entries of these answers.
        entry: The state and the two moves of each.
        choice: The answers: left, right, either or neither.
        told: The trials that heard guidance.
    """
    trial = told.nonzero().squeeze(1)
    entry, choice = entry.pick(trial), choice[trial]
    x, state = dataset.place_state(x, entry, trial)
    mirrored = entry.a0[:, 0] > entry.a0[:, 1]
    pair = (_PAIRS.to(trial.device) == entry.a0.sort(1).values[:, None]).all(2).int().argmax(1)
    x.guided[trial, state, pair, _answer(choice, mirrored)] += 1
    if not config.learn_refusals:
        return x
    known = conclude(x.guided[trial, state], rounds(config))
    for one, other in permutations(range(4), 2):
        follows = known.approved[:, one] & known.refused[:, other] & ~known.compared[:, one, other]
        x = dataset.imply(x, entry.pick(follows), (one, other), trial[follows], state[follows])
    return x


def _answer(choice: Int64[Tensor, "n"], mirrored: Bool[Tensor, "n"]) -> Int64[Tensor, "n"]:
    """The answer as `Dataset.guided` counts it: with the smaller move first."""
    first = (choice == Choice.LEFT) ^ mirrored
    decided = torch.where(first, FIRST, SECOND)
    return torch.where(
        choice == Choice.EITHER, EITHER, torch.where(choice == Choice.NEITHER, NEITHER, decided)
    )


class Memory(NamedTuple):
    """The lessons of guidance about the present state of some trials. `[i, j]` reads *i against j*."""

    better: Bool[Tensor, "N 4 4"]  # said, or following by transitivity
    equal: Bool[Tensor, "N 4 4"]  # likewise; not the diagonal
    approved: Bool[Tensor, "N 4"]  # chosen at least once: a move that the parent accepts here
    refused: Bool[Tensor, "N 4"]  # *neither*, and never chosen

    @property
    def compared(self) -> Bool[Tensor, "N 4 4"]:
        """Return the pairs whose order is known, either way round."""
        return self.better | self.better.mT | self.equal

    def worse(self, proposed: Bool[Tensor, "N 4"]) -> Bool[Tensor, "N 4"]:
        """Return the moves that are known to be worse than one of those proposed."""
        return (self.better & proposed[:, :, None]).any(1)


def rounds(config: Config) -> int:
    """Return how far orders are followed: two rounds find all of them unless answers contradict each other.

    A contradiction needs three to be found whole. Only `relabel` makes many of them; without it there are two
    rounds, as in the runs of versions 0.5 to 0.8, which are replayed bit for bit.
    """
    return 3 if config.relabel else 2


def recall(x: Dataset, observation: Tensor, rounds: int) -> Memory:
    """Look the present states up in X.

    Args:
        x: X of N trials.
        observation: The present state of each, as observed: N boards.
        rounds: As the config has them.

    Returns:
        What guidance has told there; nothing in a state that X does not hold.
    """
    return conclude(said(x, observation), rounds)


def said(x: Dataset, observation: Tensor) -> Int64[Tensor, "N 6 4"]:
    """Return how often guidance gave each answer about each pair of `PAIRS` in the present state."""
    taken = torch.arange(x.digest.shape[1], device=x.digest.device) < x.states[:, None]
    here = taken & (x.digest == fingerprint(observation.flatten(1))[:, None])
    place = here.int().argmax(1)
    told = x.guided[torch.arange(len(place), device=place.device), place]
    return told * here.any(1)[:, None, None]


def conclude(told: Int64[Tensor, "N 6 4"], rounds: int) -> Memory:
    """Return what follows: of each pair the answer that was given most often, unless two were."""
    most = told.max(2, keepdim=True).values
    leading = (told == most) & (most > 0)
    clear = leading & (leading.sum(2, keepdim=True) == 1)
    first, second, either, neither = (clear[:, :, answer] for answer in (FIRST, SECOND, EITHER, NEITHER))
    better, equal = _closure(
        _square(first, _FIRST, _SECOND) | _square(second, _SECOND, _FIRST),
        both_ways(either),
        rounds,
    )
    approved = _moves(first | either, _FIRST) | _moves(second | either, _SECOND)
    refused = _moves(neither, _FIRST) | _moves(neither, _SECOND)
    return Memory(better, equal, approved & ~refused, refused & ~approved)


def both_ways(pairs: Bool[Tensor, "N 6"]) -> Bool[Tensor, "N 4 4"]:
    """Return which moves make one of these pairs, in either order."""
    return _square(pairs, _FIRST, _SECOND) | _square(pairs, _SECOND, _FIRST)


def _square(holds: Bool[Tensor, "N 6"], row: Tensor, column: Tensor) -> Bool[Tensor, "N 4 4"]:
    square = holds.new_zeros(len(holds), 4, 4)
    square[:, row, column] = holds
    return square


def _moves(holds: Bool[Tensor, "N 6"], move: Tensor) -> Bool[Tensor, "N 4"]:
    counts = torch.zeros(len(holds), 4, dtype=torch.int64, device=holds.device)
    return counts.index_add_(1, move.to(holds.device), holds.long()) > 0


def _closure(
    better: Bool[Tensor, "N 4 4"], equal: Bool[Tensor, "N 4 4"], rounds: int
) -> tuple[Bool[Tensor, "N 4 4"], Bool[Tensor, "N 4 4"]]:
    """Return the order by transitivity. Where answers contradict each other, nothing follows."""
    least = better | equal | torch.eye(4, dtype=torch.bool, device=better.device)
    for _ in range(rounds):
        better = better | _then(better, least) | _then(least, better)
        least = least | _then(least, least)
    contradicted = better & better.mT
    itself = torch.eye(4, dtype=torch.bool, device=better.device)
    known = better | better.mT
    return better & ~contradicted, least & least.mT & ~known & ~itself


def _then(one: Bool[Tensor, "N 4 4"], other: Bool[Tensor, "N 4 4"]) -> Bool[Tensor, "N 4 4"]:
    return (one.to(torch.float32) @ other.to(torch.float32)) > 0

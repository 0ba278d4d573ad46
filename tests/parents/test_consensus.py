"""The consensus of several parents: the worked example of Dawid and Skene, and panels with a known truth."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from parenting.parents.consensus import Votes, dawid_skene, majority, trusted

PATIENTS = """
1111111 3334334 1122122 2223121 2223222 2223322 1222111 3333433 2222223 2322223 4444444 2223343 1111111
2223212 1211111 1112111 1111111 1111111 2222221 2221322 2222222 2222221 2223222 2212222 1111111 1111111
2322222 1111111 1111111 1121121 1111111 3333233 1111111 2222222 2223232 4334343 2212232 2323233 3333432
1111111 1111111 1212111 2322222 1211111 2222222
"""
"""Table 1 of Dawid & Skene (1979): 45 patients and five anaesthetists, the first of them three times."""


def counted(cases: str, answers: int = 4) -> Votes:
    """Votes of one trial: a word a question, a digit an answer; the first parent gave the first three."""
    words = cases.split()
    votes = torch.zeros(1, len(words), 5, answers, dtype=torch.float64)
    for question, word in enumerate(words):
        for place, answer in enumerate(word):
            votes[0, question, max(0, place - 2), int(answer) - 1] += 1
    return votes


def drawn(accuracy: list[float], questions: int, seed: int, trials: int = 20) -> tuple[Votes, Tensor]:
    """Votes of parents of a known accuracy on two answers, and the truth."""
    random = torch.Generator().manual_seed(seed)
    truth = torch.randint(2, (trials, questions), generator=random)
    right = torch.rand(trials, questions, len(accuracy), generator=random) < torch.tensor(accuracy)
    told = torch.where(right, truth[..., None], 1 - truth[..., None])
    return torch.nn.functional.one_hot(told, 4).double(), truth


def test_dawid_and_skene_find_what_they_published_on_their_anaesthetists() -> None:
    found = dawid_skene(counted(PATIENTS))
    assert found.common[0].mul(100).round().tolist() == [40, 42, 11, 7]
    published = [[89, 11, 0, 0], [7, 88, 5, 0], [0, 34, 66, 0], [0, 0, 56, 44]]
    assert found.told[0, 0].mul(100).round().tolist() == published


def test_one_trust_finds_who_is_right_and_more_right_answers_than_the_majority() -> None:
    accuracy = [0.95, 0.95, 0.5, 0.5, 0.5]
    votes, truth = drawn(accuracy, 60, seed=1)
    found = trusted(votes)
    assert (found.trust.mean(0) - torch.tensor(accuracy)).abs().max() < 0.08
    hits = [float((one.right.argmax(-1) == truth).double().mean()) for one in (majority(votes), found)]
    assert hits[0] < 0.9 < 0.94 < hits[1]


def test_two_of_five_who_always_lie_are_found_out() -> None:
    votes, truth = drawn([0.9, 0.9, 0.9, 0.0, 0.0], 60, seed=2)
    found = trusted(votes)
    assert found.trust[:, 3:].max() < 0.2
    assert (found.right.argmax(-1) == truth).double().mean() > 0.95
    assert (majority(votes).right.argmax(-1) == truth).double().mean() < 0.8


def test_the_sides_mean_nothing_to_trust() -> None:
    votes, _ = drawn([0.9, 0.6, 0.6], 9, seed=3)
    there, mirrored = trusted(votes), trusted(votes[..., [1, 0, 2, 3]])
    assert torch.allclose(there.right, mirrored.right[..., [1, 0, 2, 3]])
    assert torch.allclose(there.trust, mirrored.trust)


@pytest.mark.parametrize("consensus", [majority, dawid_skene, trusted])
def test_places_without_votes_change_nothing_that_was_asked(consensus: object) -> None:
    votes, _ = drawn([0.9, 0.7, 0.6], 12, seed=4)
    padded = torch.cat((votes, torch.zeros(20, 5, 3, 4, dtype=torch.float64)), 1)
    assert callable(consensus)
    assert torch.allclose(consensus(padded, None).right[:, :12], consensus(votes, None).right)


def test_an_opinion_decides_where_the_votes_do_not() -> None:
    votes = torch.zeros(1, 1, 2, 4, dtype=torch.float64)
    votes[0, 0, 0, 0] = votes[0, 0, 1, 1] = 1
    opinion = torch.tensor([[[0.2, 0.8, 0.5, 0.5]]], dtype=torch.float64)
    assert trusted(votes, opinion).right.argmax(-1).item() == 1
    assert trusted(votes, opinion.flip(2).roll(2, 2)).right.argmax(-1).item() == 0

"""The paper's Eq. (1) and (2), the entropies and Adam, on numbers worked out by hand."""

from __future__ import annotations

from math import log

import pytest
import torch

from parenting.agent.adam import adam
from parenting.agent.architecture import Padding, padding
from parenting.agent.learning import Rows, objective
from parenting.agent.policy import Heads
from parenting.agent.query import Answer, Choice, empty
from parenting.agent.state import Learner

DOUBLE = torch.float64


def test_eq_1_mu() -> None:
    answer = Answer(query=empty(len(Choice), 1, 2, 2), choice=torch.tensor(list(Choice)))
    assert answer.mu.tolist() == [[0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, 0], [0, 0]]


def rows(a0: list[list[int]], mu: list[list[float]]) -> Rows:
    board, near = torch.zeros(1, 1, 2, 2, dtype=torch.uint8), torch.zeros(1, 1, 4, dtype=torch.uint8)
    at = torch.zeros(1, len(a0), dtype=torch.int64)
    return Rows(board, near, at, torch.tensor([a0]), torch.tensor([mu], dtype=DOUBLE))


def heads(local: list[float], overall: list[float]) -> Heads:
    return Heads(*(torch.tensor([[logits]], dtype=DOUBLE) for logits in (local, overall)))


def test_eq_2_and_the_entropies() -> None:
    # z is the heads' mean: (log 3, 0, 0, 0). pi(0) / (pi(0) + pi(1)) = 3/4.
    terms = objective(heads([2 * log(3), 0, 0, 0], [0, 0, 0, 0]), rows([[0, 1], [2, 3]], [[1, 0], [1, 1]]))
    # left over right: -log 3/4; then one entry for each side of an even pair: 2 log 2
    assert float(terms.loss) == pytest.approx(-log(3 / 4) + 2 * log(2))
    # Three entries. Global: uniform, log 4 each. Local: softmax is (9, 1, 1, 1) / 12.
    local = -(9 / 12 * log(9 / 12) + 3 / 12 * log(1 / 12))
    assert float(terms.entropy_global) == pytest.approx(3 * log(4))
    assert float(terms.entropy_local) == pytest.approx(3 * local)


def test_eq_2_of_a_saturated_policy_is_finite() -> None:
    terms = objective(heads([2000, 0, 0, 0], [0, 0, 0, 0]), rows([[0, 1]], [[0, 1]]))
    assert float(terms.loss) == 1000  # softplus(1000)


def test_adam_is_torchs_and_leaves_other_trials_alone() -> None:
    start = torch.linspace(-1, 1, 6, dtype=DOUBLE).view(2, 3)
    zero, frozen = torch.zeros_like(start), start.new_zeros(0, 2, 3)
    learner = Learner(
        params=start.clone(),
        exp_avg=zero.clone(),
        exp_avg_sq=zero.clone(),
        steps=torch.zeros(2, dtype=torch.int64),
        owed=torch.zeros(2, dtype=torch.bool),
        frozen=frozen,
    )
    theirs = start[0].clone().requires_grad_()
    optimiser = torch.optim.Adam([theirs], lr=0.01)
    for step in range(1, 6):
        gradient = torch.tensor([[0.5, -2.0, 0.1]], dtype=DOUBLE) * step  # of the trial that trains
        theirs.grad = gradient[0].clone()
        optimiser.step()
        adam(learner.params, learner, gradient, torch.tensor([True, False]), 0.01)
    torch.testing.assert_close(learner.params[0], theirs.detach(), rtol=1e-10, atol=1e-12)
    assert torch.equal(learner.params[1], start[1])
    assert learner.steps.tolist() == [5, 0]


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_adam_has_the_bits_of_torchs_fused_optimiser(dtype: torch.dtype) -> None:
    """Trials that have taken different numbers of steps, each against an optimiser of its own."""
    draw = torch.Generator().manual_seed(5)
    start = torch.randn(3, 1001, dtype=dtype, generator=draw)
    learner = Learner(
        params=start.clone(),
        exp_avg=torch.zeros_like(start),
        exp_avg_sq=torch.zeros_like(start),
        steps=torch.zeros(3, dtype=torch.int64),
        owed=torch.zeros(3, dtype=torch.bool),
        frozen=start.new_zeros(0, 3, 1001),
    )
    theirs = [row.clone().requires_grad_() for row in start]
    optimisers = [torch.optim.Adam([one], lr=0.003, fused=True) for one in theirs]
    for training in ([True, True, False], [True, False, False], [False, True, True]) * 4:
        gradient = torch.randn(sum(training), 1001, dtype=dtype, generator=draw)
        trained = [trial for trial in range(3) if training[trial]]
        for trial, row in zip(trained, gradient, strict=True):
            theirs[trial].grad = row.clone()
            optimisers[trial].step()
        adam(learner.params, learner, gradient, torch.tensor(training), 0.003)
    for trial, (one, optimiser) in enumerate(zip(theirs, optimisers, strict=True)):
        state = optimiser.state[one]
        assert torch.equal(learner.params[trial], one.detach())
        assert torch.equal(learner.exp_avg[trial], state["exp_avg"])
        assert torch.equal(learner.exp_avg_sq[trial], state["exp_avg_sq"])
        assert int(learner.steps[trial]) == int(state["step"])


@pytest.mark.parametrize(
    ("length", "becomes"),
    [(9, (0, 0, 7)), (4, (0, 0, 2)), (3, (0, 1, 2)), (2, (1, 1, 2)), (1, (1, 1, 1))],
)
def test_sides_of_a_convolution(length: int, becomes: tuple[int, int, int]) -> None:
    assert padding(length) == Padding(*becomes)

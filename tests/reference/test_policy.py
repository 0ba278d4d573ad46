"""The reference's network (Sec. 3.1.1) and loss (Eq. 2), by numbers worked out by hand."""

from math import log

import pytest
import torch
from torch import nn

from parenting.agent.config import Config
from parenting.envs.rng import Stream, keys
from reference.parenting import Reference
from reference.policy import Policy, distinct, flat, loss
from tests.reference.examples import ROOM, set_logits, world

SEEN = ((0, 0, 0, 0, 0), (0, 4, 1, 3, 0), (0, 0, 0, 0, 0))  # the room's first observation


def new(level: str) -> Policy:
    return Policy(world(level), keys(0, 1))


# ---- Eq. (2): the loss ----


@pytest.mark.parametrize(
    ("near", "mu", "expected"),
    [
        ((2 * log(3), 0, 0, 0), {0: 1.0, 1: 0.0}, log(4 / 3)),  # z = (ln 3, 0, 0, 0): the fraction is 3/4
        ((2 * log(3), 0, 0, 0), {0: 0.0, 1: 1.0}, log(4)),
        ((2 * log(3), 0, 0, 0), {0: 0.5, 1: 0.5}, 0.5 * log(4 / 3) + 0.5 * log(4)),
        ((2 * log(3), 0, 0, 0), {0: 2.0, 1: 1.0}, 2 * log(4 / 3) + log(4)),  # three entries in one row
        ((2 * log(3), 0, 0, 0), {2: 1.0, 3: 0.0}, log(2)),  # the other actions do not matter
        ((2000.0, 0, 0, 0), {0: 0.0, 1: 1.0}, 1000.0),  # nothing overflows
    ],
)
def test_loss(near: tuple[float, ...], mu: dict[int, float], expected: float) -> None:
    policy = new(ROOM)
    set_logits(policy, near)
    assert loss(policy, [(SEEN, mu)], 0, 0).item() == pytest.approx(expected, abs=1e-12)


def test_entropy_of_each_head_is_subtracted_for_each_entry() -> None:
    policy = new(ROOM)
    set_logits(policy, near=(log(3), log(3), 0, 0))  # the softmax is (3, 3, 1, 1) / 8
    rows = [(SEEN, {0: 2.0, 1: 1.0})]
    far, near = log(4), 0.75 * log(8 / 3) + 0.25 * log(8)
    assert loss(policy, rows, 0.1, 0.01).item() == pytest.approx(3 * (log(2) - 0.1 * far - 0.01 * near))


def test_distinct_rows_sum_mu_whichever_side_was_left() -> None:
    here, there = ((0,),), ((1,),)
    entries = [(here, (2, 1), (1.0, 0.0)), (there, (2, 1), (0.5, 0.5)), (here, (1, 2), (0.5, 0.5))]
    assert distinct(entries) == [(here, {2: 1.5, 1: 0.5}), (there, {2: 0.5, 1: 0.5})]


# ---- 3.1.1: the network ----


LOCAL, OUT = [[20, 64], [64], [64, 4], [4]], [[64], [64, 4], [4]]
CONVOLUTIONS = [[45, 16], [16], [144, 32], [32], [288, 64], [64], [576, 64], [64]]


@pytest.mark.parametrize(
    ("level", "layers", "fan_in"),
    [
        (ROOM, 2, 2 * 2 * 32),  # 3 x 5, 2 x 3, 2 x 2
        ("island", 3, 2 * 2 * 64),  # 6 x 8, 4 x 6, 2 x 4, 2 x 2
        ("island-bottleneck", 4, 2 * 2 * 64),  # 7 x 9, 5 x 7, 3 x 5, 2 x 3, 2 x 2
    ],
)
def test_shapes(level: str, layers: int, fan_in: int) -> None:
    weights = [flat(p) if p.dim() > 1 else p for p in new(level).parameters()]
    expected = [*LOCAL, *CONVOLUTIONS[: 2 * layers], [fan_in, 64], *OUT]
    assert [list(weight.shape) for weight in weights] == expected


def test_zeros_lie_behind_a_side_of_three_and_around_a_shorter_one() -> None:
    first, second = (layer.padding for layer in new(ROOM).convolutions if isinstance(layer, nn.ZeroPad2d))
    assert (first, second) == ((0, 0, 0, 1), (0, 1, 1, 1))  # left, right, top, bottom: 3 x 5, then 2 x 3


def test_glorot_weights_are_drawn_from_the_trials_keys() -> None:
    trial = Reference(world("island"), Config(), seed=3, trial=2, choose=lambda *_: "either")
    weights = trial.parameters()[0]
    u = keys(3, 5).uniform(Stream.WEIGHTS + 2, 45, 16)[2]  # tick 0; the third layer is the first convolution
    bound = (6 / (9 * 5 + 9 * 16)) ** 0.5
    assert torch.allclose(weights[4], (2 * u - 1) * bound, atol=1e-15)
    kernel = next(trial.pi.convolutions.parameters())
    assert kernel[7, 4, 2, 1] == weights[4][(4 * 3 + 2) * 3 + 1, 7]
    assert not weights[5].any()

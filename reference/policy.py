"""The policy of the reference: its network (Sec. 3.1.1) and its loss (Sec. 2.3)."""

from collections.abc import Sequence
from functools import cache
from math import log

import torch
from torch import Tensor, nn
from torch.nn import functional

from parenting.envs.gridworld import Gridworld
from parenting.envs.levels.spec import maze_legend
from parenting.envs.rng import Keys, Stream
from reference.clips import Board

Row = tuple[Board, dict[int, float]]
"""Entries of X with one first state s_0 and one pair of first actions: the sum of their mu, by action."""


class Policy(nn.Module):
    """Two heads, each to one logit an action: `near` sees l(s), `far` (the paper's global head) the board."""

    def __init__(self, world: Gridworld, keys: Keys) -> None:
        super().__init__()
        self.agent, self.codes = world.code("A"), len(maze_legend(world.legend))
        self.near = nn.Sequential(nn.Linear(4 * self.codes, 64), nn.ReLU(), nn.Linear(64, 4))
        self.convolutions = nn.Sequential()
        height, width, channels = world.height, world.width, self.codes
        for filters in (16, 32, 64, 64):
            if height <= 2 and width <= 2:
                break
            (top, bottom), (left, right) = padding(height), padding(width)
            pad = nn.ZeroPad2d((left, right, top, bottom))
            self.convolutions.extend([pad, nn.Conv2d(channels, filters, 3), nn.ReLU()])
            height, width, channels = height + top + bottom - 2, width + left + right - 2, filters
        self.far = nn.Sequential(nn.Linear(height * width * channels, 64), nn.ReLU(), nn.Linear(64, 4))
        self.double().draw(keys)

    def draw(self, keys: Keys) -> None:
        """Glorot uniform weights, zero biases. A convolution's window is 9 cells, a dense layer's 1."""
        parameters = self.parameters()  # of each layer the weight, then the bias
        for i, (weight, bias) in enumerate(zip(parameters, parameters, strict=True)):
            window = weight[0, 0].numel()
            bound = (6 / (window * (weight.shape[0] + weight.shape[1]))) ** 0.5
            u = keys.uniform(Stream.WEIGHTS + i, *flat(weight).shape)[0]
            flat(weight.data).copy_((2 * u - 1) * bound)
            bias.data.zero_()

    def heads(self, observations: Sequence[Board]) -> tuple[Tensor, Tensor]:
        """The logits [observations, 4] of both heads; the policy is the softmax of their mean."""
        l = torch.tensor([local_state(seen, position(seen, self.agent)) for seen in observations])
        near, far = (functional.one_hot(c, self.codes).double() for c in (l, torch.tensor(observations)))
        far = self.convolutions(far.permute(0, 3, 1, 2)).permute(0, 2, 3, 1)  # flat: row, column, channel
        return self.near(near.flatten(1)), self.far(far.flatten(1))


@cache
def position(observation: Board, code: int) -> tuple[int, int]:
    """Row and column of the one cell with this code."""
    return next((y, x) for y, row in enumerate(observation) for x, seen in enumerate(row) if seen == code)


@cache
def local_state(observation: Board, agent: tuple[int, ...]) -> tuple[int, ...]:
    """l(s): the cells above, below, left and right of the agent, as observed; beyond the edge is wall, 0."""
    height, width = len(observation), len(observation[0])
    cells = [(agent[0] + dy, agent[1] + dx) for dy, dx in ((-1, 0), (1, 0), (0, -1), (0, 1))]
    return tuple(observation[y][x] if 0 <= y < height and 0 <= x < width else 0 for y, x in cells)


def gumbel(u: float) -> float:
    """Standard Gumbel noise: the argmax of (logits + noise) is a draw from their softmax."""
    return -log(-log(max(u, 2.0**-53)))


def padding(side: int) -> tuple[int, int]:
    """The zeros before and behind: a side above 3 shrinks by 2, one of 3 to 2, a smaller one stays."""
    return (0, 0) if side > 3 else (0, 1) if side == 3 else (1, 1)


def flat(weight: Tensor) -> Tensor:
    """A weight as a view [fan in, out]; the fan in of a convolution in the order channel, row, column."""
    return weight.flatten(1).T


def loss(policy: Policy, rows: Sequence[Row], lambda_global: float, lambda_local: float) -> Tensor:
    """Eq. (2) less the entropy of each head, summed over the entries. Each entry's mu sums to 1."""
    near, far = policy.heads([state for state, _ in rows])
    actions = torch.tensor([list(mu) for _, mu in rows])
    mu = torch.tensor([list(mu.values()) for _, mu in rows], dtype=torch.float64)
    # log(pi(a_i|s) / (pi(a_0|s) + pi(a_1|s))): the two logits' own softmax, in which nothing overflows
    log_fraction = ((near + far) / 2).gather(1, actions).log_softmax(1)
    entropies = lambda_global * entropy(far) + lambda_local * entropy(near)
    return -(mu * log_fraction).sum() - (mu.sum(1) * entropies).sum()


def entropy(logits: Tensor) -> Tensor:
    """The entropy of the softmax of each row."""
    return -(logits.softmax(1) * logits.log_softmax(1)).sum(1)


def distinct(entries: Sequence[tuple[Board, tuple[int, int], tuple[float, float]]]) -> list[Row]:
    """Entries (state, actions, mu) as rows: each state and unordered pair once, the first seen first."""
    rows: dict[object, Row] = {}
    for state, actions, mu in entries:
        _, sums = rows.setdefault((state, frozenset(actions)), (state, dict.fromkeys(actions, 0.0)))
        for action, share in zip(actions, mu, strict=True):
            sums[action] += share
    return list(rows.values())

"""Planning on a reward in a listed world, and fitting a reward to preferences between clips (Sec. 4.2)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Float64, Int64
from torch import Tensor

from parenting.envs.mdp import Model

LETTERS = "udlr"
RIDGE = 1e-9
"""A pull towards 0, so that what no pair decides, the shift above all, has one answer."""


class Way(NamedTuple):
    """A walk from the start: its letters, what it earns, whether it arrives, whether it does harm."""

    letters: str
    earned: float
    arrives: bool
    harms: bool


class Pairs(NamedTuple):
    """Pairs of clips of one length: the states and actions of either side."""

    at: Int64[Tensor, "K 2 T"]
    action: Int64[Tensor, "K 2 T"]

    def difference(self, reward: Float64[Tensor, "S 4"]) -> Float64[Tensor, "K"]:
        """Return by how much the left clip earns more, as in Eq. (12)."""
        earned = reward[self.at, self.action].sum(2)
        return earned[:, 0] - earned[:, 1]


def follow(model: Model, reward: Float64[Tensor, "S 4"], letters: str) -> Way:
    """Walk by letters from the start of the first level, until the episode is over."""
    at, total, harms, done = 0, 0.0, False, ""
    for letter in letters:
        if bool(model.terminal[at]):
            break
        action = LETTERS.index(letter)
        total, done = total + float(reward[at, action]), done + letter
        harms |= bool(model.unsafe[at, action])
        at = int(model.next_state[at, action])
    return Way(done, total, bool(model.terminal[at]), harms)


def plan(model: Model, reward: Float64[Tensor, "S 4"], horizon: int) -> Way:
    """The walk that earns most in `horizon` steps, by dynamic programming; it ends where an episode does."""
    values = [torch.zeros(len(reward), dtype=torch.float64)]
    for _ in range(horizon):
        best = (reward + values[-1][model.next_state]).max(1).values
        values.append(torch.where(model.terminal, 0.0, best))
    letters, at = "", 0
    for left in range(horizon, 0, -1):
        if bool(model.terminal[at]):
            break
        action = int((reward[at] + values[left - 1][model.next_state[at]]).argmax())
        letters, at = letters + LETTERS[action], int(model.next_state[at, action])
    return follow(model, reward, letters)


def random_pairs(model: Model, count: int, length: int, generator: torch.Generator) -> Pairs:
    """Pairs of random walks of `length` steps, each from a random state in which life goes on.

    At an end an agent rests, so that all clips have one length.
    """
    living = (~model.terminal).nonzero().squeeze(1)
    now = living[_throw(len(living), count, generator, living.device)]
    at, actions = [], []
    for _ in range(length):
        action = _throw(4, count, generator, living.device)
        at.append(now)
        actions.append(action)
        now = model.next_state[now, action]
    return Pairs(torch.stack(at, 2), torch.stack(actions, 2))


def _throw(sides: int, count: int, generator: torch.Generator, device: torch.device) -> Int64[Tensor, "K 2"]:
    """Drawn on the generator's device, so that the draws are the same on every device."""
    return torch.randint(sides, (count, 2), generator=generator, device=generator.device).to(device)


def preferences(pairs: Pairs, reward: Float64[Tensor, "S 4"]) -> Float64[Tensor, "K"]:
    """Return the probability that a person with this reward prefers the left clip (Bradley and Terry)."""
    return torch.sigmoid(pairs.difference(reward))


def cross_entropy(pairs: Pairs, chance: Float64[Tensor, "K"], reward: Float64[Tensor, "S 4"]) -> Tensor:
    """The loss of a reward model on preferences, a mean over the pairs."""
    margin = pairs.difference(reward)
    return torch.nn.functional.binary_cross_entropy_with_logits(margin, chance)


def fit(pairs: Pairs, chance: Float64[Tensor, "K"], states: int) -> Float64[Tensor, "S 4"]:
    """The reward of every state and action that explains preferences best, by L-BFGS."""
    reward = torch.zeros(states, 4, dtype=torch.float64, requires_grad=True)
    search = torch.optim.LBFGS([reward], max_iter=2000, tolerance_grad=1e-10, line_search_fn="strong_wolfe")

    def close() -> Tensor:
        search.zero_grad()
        loss = cross_entropy(pairs, chance, reward) + RIDGE * reward.square().sum()
        loss.backward()  # type: ignore[no-untyped-call]
        return loss

    with torch.enable_grad():
        search.step(close)  # type: ignore[no-untyped-call]
    return reward.detach()

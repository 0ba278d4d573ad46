"""Pre-training from scratch: one policy on random mazes until it has converged (Sec. 3.1.4)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

from parenting.agent.adam import adam
from parenting.agent.learning import entropy
from parenting.agent.policy import Network
from parenting.agent.pretraining import RATE, policy_gradient
from parenting.agent.pretraining_mazes import ARRIVED, LIMIT, Pool, outside, pool
from parenting.agent.state import Rehearsal
from parenting.envs.rng import keys
from parenting.envs.struct import Struct

WINDOW, GAIN = 300, 0.5
"""Converged: the mean return of the last 300 steps is less than 0.5 above that of the 300 before (ours),"""
SOLVES, LOOK_EVERY = 0.95, 50
"""and the argmax policy solves this share of mazes outside the pool (ours), looked at so often."""


CELLS = 1 << 17
"""Cells of boards that are looked at together in an exam."""


class TrainState(Struct):
    """A policy in pre-training and all that its next step depends on. One trial."""

    params: Float[Tensor, "N P"]
    moments: Rehearsal
    tick: Int64[Tensor, "N"]
    returns: Float[Tensor, "steps"]  # the mean return of each step so far


class EvalResult(NamedTuple):
    """The policy's results in mazes outside the pool."""

    solved: float  # the share of mazes that its argmax solves
    entropy: float  # nats, mean over their states: how open it is to its parent
    gap: float  # between the two largest logits, mean over their states


class Pretrainer:
    """Pre-training for one size of board and one legend, on one device."""

    def __init__(self, network: Network, glyphs: str, seed: int = 0, device: str = "cpu") -> None:
        """Draw the mazes; weights and episodes follow from `seed`."""
        self.network, self.seed = network, seed
        self.pool = pool(network.height, network.width, glyphs, device)
        self.outside = outside(network.height, network.width, glyphs, device)
        self.device = device

    def init(self) -> TrainState:
        """A policy at step 0."""
        params = self.network.init_params(keys(self.seed, 1, self.device), torch.float32)
        return TrainState(
            params=params,
            moments=Rehearsal(
                exp_avg=torch.zeros_like(params),
                exp_avg_sq=torch.zeros_like(params),
                steps=torch.zeros(1, dtype=torch.int64, device=self.device),
                owed=torch.ones(1, dtype=torch.bool, device=self.device),
            ),
            tick=torch.zeros(1, dtype=torch.int64, device=self.device),
            returns=torch.zeros(0),
        )

    def update(self, train_state: TrainState) -> TrainState:
        """Take one step: 16 whole episodes and one step of Adam.

        An interruption leaves `train_state` as it was.
        """
        tick, params, moments = train_state.tick + 1, train_state.params.clone(), train_state.moments.clone()
        found, earned = policy_gradient(
            self.network, params, self.pool, keys(self.seed, 1, self.device).replace(tick=tick)
        )
        adam(params, moments, found, moments.owed, RATE)
        returns = torch.cat((train_state.returns, earned.float().cpu()))
        return TrainState(params=params, moments=moments, tick=tick, returns=returns)

    def converged(self, train_state: TrainState) -> bool:
        """Return True once the returns have stopped rising and mazes outside the pool are solved."""
        steps = len(train_state.returns)
        if steps < 2 * WINDOW or steps % LOOK_EVERY:
            return False
        last, before = train_state.returns[-WINDOW:].mean(), train_state.returns[-2 * WINDOW : -WINDOW].mean()
        return bool(last - before < GAIN) and self.evaluate(train_state.params[0]).solved >= SOLVES

    def evaluate(self, weights: Float[Tensor, "P"]) -> EvalResult:
        """The argmax policy in the mazes outside the pool."""
        logits = _logits(self.network, weights, self.outside)
        real = torch.arange(logits.shape[1], device=logits.device) < self.outside.size[:, None]
        two = logits.topk(2, dim=2).values
        return EvalResult(
            solved=float(_solved(self.outside, logits.argmax(2)).double().mean()),
            entropy=float(entropy(logits)[real].mean()),
            gap=float((two[..., 0] - two[..., 1])[real].mean()),
        )


def _logits(network: Network, weights: Float[Tensor, "P"], mazes: Pool) -> Float[Tensor, "M S 4"]:
    """The policy in every state of every maze, some mazes at a time: a large one has much to be seen."""
    count, most = mazes.cell.shape
    logits = weights.new_empty(count, most, 4)
    some = max(1, CELLS // (most * network.height * network.width))
    for first in range(0, count, some):
        maze = torch.arange(first, min(first + some, count), device=weights.device)
        logits[maze] = _logits_in(network, weights, mazes, maze)
    return logits


def _logits_in(
    network: Network, weights: Float[Tensor, "P"], mazes: Pool, maze: Int64[Tensor, "K"]
) -> Float[Tensor, "K S 4"]:
    local_state = mazes.local_state[maze]
    state = torch.arange(local_state.shape[1], device=weights.device).expand(len(maze), -1)
    observation = mazes.observation(maze[:, None].expand_as(state), state)
    with torch.no_grad():
        layers = network.unpack(weights[None])
        heads = network.heads(layers, observation.flatten(0, 1)[None], local_state.flatten(0, 1)[None])
    return heads.logits.view(local_state.shape)


def _solved(mazes: Pool, action: Int64[Tensor, "M S"]) -> Bool[Tensor, "M"]:
    """Say which mazes a policy that always takes `action` solves before an episode is cut off."""
    next_state = mazes.next_state.gather(2, action[:, :, None]).squeeze(2)
    at = mazes.first
    for _ in range(LIMIT):
        onward = next_state.gather(1, at.clamp_min(0)[:, None]).squeeze(1)
        at = torch.where(at == ARRIVED, at, onward)
    return at == ARRIVED

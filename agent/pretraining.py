"""Pre-training on random path-connected mazes, so that an agent can walk before it is parented (Sec. 3.1.4).

A step is 16 whole episodes and one step of Adam: REINFORCE with returns to go, less their mean and divided by
their standard deviation over the step (ours); and a little entropy, so that the policy stays open to its
parent.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Float, Float64, UInt8
from torch import Tensor

from parenting.agent.adam import adam
from parenting.agent.config import Config
from parenting.agent.learning import entropy, taken
from parenting.agent.policy import Network
from parenting.agent.pretraining_mazes import Batch, Pool, Walks, draw_mazes, pool, walk
from parenting.agent.state import AgentState
from parenting.envs.giving_way import give_way
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Keys

GOAL, STEP = 50.0, -1.0
"""Rewards in a maze: +50 at the goal, -1 (?) a step."""
ENTROPY = 0.1
"""The entropy coefficient, where returns have a standard deviation of 1 (ours)."""
RATE = 0.001
"""Adam's step size, its default."""


class Visits(NamedTuple):
    """The distinct states that a trial's episodes came by, with their shares in the gradient."""

    observation: UInt8[Tensor, "N V H W"]
    local_state: UInt8[Tensor, "N V 4"]
    worth: Float[Tensor, "N V 4"]  # normalised returns to go, summed by action, over the number of steps
    share: Float[Tensor, "N V"]  # of all steps


def rehearse(world: Gridworld, network: Network, config: Config, state: AgentState) -> AgentState:
    """The step of pre-training that the training of the tick before owes; so mazes are not forgotten.

    It is taken when this tick's query is out: nobody waits for it. Updates the learner in place.
    """
    if not config.pretrain:
        return state
    mine = state.rehearsal
    trial = mine.owed.nonzero().squeeze(1)
    if len(trial):
        params, keys = state.learner.params, state.keys.pick(trial)
        gradient, _ = policy_gradient(network, taken(params, trial), pool(*_size(world)), keys)
        adam(params, mine, gradient, mine.owed, RATE)
    return state.replace(rehearsal=mine.replace(owed=state.info.trained))


def _size(world: Gridworld) -> tuple[int, int, str, str]:
    return world.height, world.width, world.legend, str(world.device)


def policy_gradient(
    network: Network, parameters: Float[Tensor, "N P"], pool: Pool, keys: Keys
) -> tuple[Float[Tensor, "N P"], Float64[Tensor, "N"]]:
    """The gradient of one step, each trial's by itself, and the mean return of its 16 episodes."""
    give_way()
    batch = draw_mazes(pool, keys)
    with torch.no_grad():
        logits = network.heads(network.unpack(parameters), batch.observation, batch.local_state).logits
    walks = walk(batch, logits.double().softmax(2), keys)
    earned = returns_to_go(walks)
    visits = visited(batch, walks, earned, logits.dtype)
    return differentiate(network, parameters, visits), earned[:, 0].mean(1)


def returns_to_go(walks: Walks) -> Float64[Tensor, "N T E"]:
    """The return of each episode from each of its steps on; 0 once it has ended."""
    left = walks.alive.flip(1).cumsum(1).flip(1).double()
    return (STEP * left + GOAL * walks.arrived[:, None].double()) * walks.alive


def visited(batch: Batch, walks: Walks, earned: Float64[Tensor, "N T E"], dtype: torch.dtype) -> Visits:
    """All steps of the episodes, summed over the distinct states that they were taken in."""
    rows = batch.observation.shape[1]  # R; row R is the goal, where nothing is done any more
    steps = walks.alive.sum((1, 2))  # [N]
    share = _total(walks.state, walks.alive.double() / steps[:, None, None], rows + 1)[:, :rows]  # [N, R]
    taken = 4 * walks.state + walks.action  # [N, T, E]: a number for each row and action
    worth = _total(taken, _normalised(earned, walks) / steps[:, None, None], 4 * rows + 4)  # [N, 4 (R + 1)]
    worth = worth.view(-1, rows + 1, 4)[:, :rows]  # [N, R, 4]
    came = share > 0  # [N, R]
    most = int(came.sum(1).max())  # V
    place = came.long().argsort(dim=1, descending=True, stable=True)[:, :most]  # [N, V]: visited rows first
    every = torch.arange(len(place), device=place.device)[:, None]  # [N, 1]
    return Visits(
        observation=batch.observation[every, place],
        local_state=batch.local_state[every, place],
        worth=worth[every, place].to(dtype),
        share=share[every, place].to(dtype),
    )


def _normalised(earned: Float64[Tensor, "N T E"], walks: Walks) -> Float64[Tensor, "N T E"]:
    """Returns to go, less their mean and divided by their standard deviation over the step (ours)."""
    steps = walks.alive.sum((1, 2))
    centred = (earned - (earned.sum((1, 2)) / steps)[:, None, None]) * walks.alive
    deviation = (centred.square().sum((1, 2)) / steps).sqrt()
    return centred / deviation.clamp_min(1e-8)[:, None, None]


def _total(place: Tensor, amount: Tensor, size: int) -> Tensor:
    """Amounts summed by place."""
    zero = amount.new_zeros(len(amount), size)
    return zero.scatter_add_(1, place.flatten(1), amount.flatten(1))


def differentiate(
    network: Network, parameters: Float[Tensor, "N P"], visits: Visits, weight: float = ENTROPY
) -> Float[Tensor, "N P"]:
    """The gradient of REINFORCE's loss, less the entropy by its `weight`, at the distinct states."""
    layers = network.leaf_params(parameters)
    with torch.enable_grad():
        logits = network.heads(layers, visits.observation, visits.local_state).logits
        gain = (visits.worth * logits.log_softmax(2)).sum((1, 2))
        open_minded = (visits.share * entropy(logits)).sum(1)
        return network.gradient(-gain - weight * open_minded, layers)

"""Traditional RL, the first row of Table 1: policy gradients from scratch, on the reward itself (Sec. 3.2.1).

As in pre-training (Sec. 3.1.4): REINFORCE with returns to go, 16 whole episodes and one step of Adam at a
time, with the agent's own network and optimiser. A baseline is subtracted: the mean return to go of the step,
and what is left is divided by its standard deviation (ours). A little entropy is worth something, too.

The policy does not change within a step, so its chances are worked out once in every state of the world, and
episodes are looked up in tables. So it needs a world whose states can be listed.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Float, Float64, Int64, UInt8
from torch import Tensor

from parenting.agent.adam import adam
from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.agent.pretraining import ENTROPY, differentiate, visited
from parenting.agent.pretraining_mazes import EPISODES, Batch, Walks, walk
from parenting.envs.gridworld import Gridworld
from parenting.envs.mdp import Model, explore
from parenting.envs.rng import Keys
from parenting.envs.struct import Struct
from parenting.evaluation.argmax import TabularEvaluation


class Tables(NamedTuple):
    """The R states of a world in which an episode goes on; row R stands for its end."""

    seen: UInt8[Tensor, "R H W"]
    near: UInt8[Tensor, "R 4"]
    then: Int64[Tensor, "R1 4"]
    reward: Float64[Tensor, "R1 4"]
    unsafe: Bool[Tensor, "R1 4"]

    def batch(self, trials: int) -> Batch:
        """The same world for every trial, each with its 16 episodes at the start."""
        first = self.then.new_zeros(trials, EPISODES)
        seen, near, then = (part.expand(trials, *part.shape) for part in (self.seen, self.near, self.then))
        return Batch(observation=seen, local_state=near, next_state=then, first=first)


class Learners(Struct):
    """Policies that learn from reward, one a trial, and what has happened to each."""

    trial: Int64[Tensor, "N"]
    live: Float[Tensor, "N P"]
    exp_avg: Float[Tensor, "N P"]  # Adam's first moments
    exp_avg_sq: Float[Tensor, "N P"]  # Adam's second moments
    steps: Int64[Tensor, "N"]  # gradient steps
    deaths: Int64[Tensor, "N"]  # unsafe steps (docs/paper.md, "Unsafe")
    ticks: Int64[Tensor, "N"]  # steps in the world
    optimal: Bool[Tensor, "N"]


def tables(model: Model, evaluation: TabularEvaluation) -> Tables:
    """A model's states as rows; the start of the only level is row 0.

    Raises:
        ValueError: the world has several levels.
    """
    if len(evaluation.starts) != 1:
        raise ValueError("Policy gradients learn on one level at a time.")
    living = (~model.terminal).nonzero().squeeze(1)
    row = torch.full_like(model.terminal, len(living), dtype=torch.int64)
    row[living] = torch.arange(len(living))
    end = torch.full((1, 4), len(living))
    nothing = torch.zeros(1, 4, dtype=torch.float64)
    return Tables(
        seen=evaluation.observation[living],
        near=evaluation.local_state[living],
        then=torch.cat((row[model.next_state[living]], end)),
        reward=torch.cat((model.reward[living], nothing)),
        unsafe=torch.cat((model.unsafe[living], nothing.bool())),
    )


def train_reinforce(
    world: Gridworld, config: Config, keys: Keys, max_steps: int, entropy: float = ENTROPY
) -> Learners:
    """Train one policy for each of `keys` until its argmax is optimal, for at most `max_steps` steps.

    Whoever is born optimal takes no step. `entropy` is what the policy's entropy is worth, against returns to
    go of deviation 1.

    Raises:
        ValueError: too many states to list, or several levels.
    """
    model = explore(world)
    judge = TabularEvaluation(world, model, config.gamma)
    known = tables(model, judge)
    some = _judged(judge, _born(world, config, keys))
    done: list[Learners] = []
    for step in range(1, max_steps + 1):
        if bool(some.optimal.any()):
            done.append(some.pick(some.optimal))
            some = some.pick(~some.optimal)
        if not len(some.trial):
            break
        now = keys.pick(some.trial).replace(tick=torch.full_like(some.trial, step))
        _learn(world, config, known, some, now, entropy)
        some = _judged(judge, some)
    return _together([*done, some])


def _judged(judge: TabularEvaluation, some: Learners) -> Learners:
    return some.replace(optimal=judge.optimal(some.live))


def _born(world: Gridworld, config: Config, keys: Keys) -> Learners:
    live = network_of(world).init_params(keys, getattr(torch, config.dtype))
    zero = torch.zeros_like(keys.tick)
    return Learners(
        trial=torch.arange(len(zero)),
        live=live,
        exp_avg=torch.zeros_like(live),
        exp_avg_sq=torch.zeros_like(live),
        steps=zero,
        deaths=zero.clone(),
        ticks=zero.clone(),
        optimal=zero.bool(),
    )


def _learn(
    world: Gridworld, config: Config, known: Tables, some: Learners, keys: Keys, entropy: float
) -> None:
    """16 episodes and a step of Adam, in place."""
    network, batch = network_of(world), known.batch(len(some.trial))
    with torch.no_grad():
        logits = network.heads(network.unpack(some.live), batch.observation, batch.local_state).logits
    walks = walk(batch, logits.double().softmax(2), keys, config.max_episode_steps)
    visits = visited(batch, walks, returns_to_go(known, walks, config.gamma), logits.dtype)
    adam(
        some.live,
        some,
        differentiate(network, some.live, visits, entropy),
        torch.ones_like(some.optimal),
        config.learning_rate,
    )
    some.deaths.add_(known.unsafe[walks.state, walks.action].sum((1, 2)))
    some.ticks.add_(walks.alive.sum((1, 2)))


def returns_to_go(known: Tables, walks: Walks, gamma: float) -> Float64[Tensor, "N T E"]:
    """The discounted reward that each episode earns from each of its steps on; 0 once it has ended."""
    earned = known.reward[walks.state, walks.action]
    for t in range(earned.shape[1] - 2, -1, -1):
        earned[:, t] += gamma * earned[:, t + 1]
    return earned


def _together(parts: list[Learners]) -> Learners:
    whole = Learners.joined(parts)
    return whole.pick(whole.trial.argsort())

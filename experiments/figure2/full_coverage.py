"""The full-coverage agent (cf. DAgger): its X holds every pair of actions in the states that it visits (3.3).

Network, loss, optimiser and clips are those of every agent; only the source of the queries differs. The agent
walks a fixed number of episodes with fixed environment noise, and then again with some random actions.
In every state that it comes to, the scripted parent compares all six pairs of first moves, each as a clip of
length T that goes on by the frozen policies (Eq. 5, 6; drying left out, as in the look-ahead). It trains on
all of that, and walks again, so many rounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import torch
from jaxtyping import Float, Float64, Int64, UInt8
from torch import Tensor

from parenting.agent.adam import adam
from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.agent.learning import Rows, differentiate
from parenting.envs.fingerprint import fingerprint, together
from parenting.envs.gridworld import WorldState, local_state
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import Keys, Stream
from parenting.envs.struct import Struct
from parenting.evaluation.rollouts import argmax, rollout
from parenting.experiments.baselines.reinforce_rollouts import Moments
from parenting.experiments.figure2.all_pairs import PAIRS, pair_answers
from parenting.experiments.figure2.settings import Budget
from parenting.parents.scripted import ScriptedRule

BATCH = 128
"""Distinct states in a gradient step, each with all its pairs."""
EPSILON = 0.25
"""Of the moves in every second walk: clips put the frozen policies where they would not go themselves."""
LONG = 1_000_000
"""More passes over X than a stage has."""


class CoverageStage(NamedTuple):
    """A stage at its end."""

    live: Float[Tensor, "1 P"]
    questions: int  # asked in this stage
    states: int  # what X can tell apart
    reached: int  # what the policy comes to in its episodes
    known: int  # how much of that is in X


class VisitedStates(Struct):
    """The distinct states in which a policy had to choose."""

    states: WorldState
    seen: UInt8[Tensor, "N H W"]
    truth: Int64[Tensor, "N"]  # a word for what is true
    sight: Int64[Tensor, "N"]  # a word for what the agent sees: not whether the plant under it is dry
    visits: Int64[Tensor, "N"]


class Dataset:
    """X by observation, in the order of discovery.

    States that the agent cannot tell apart are one row, with answers in proportion to the visits.
    """

    def __init__(self, world: RewardHacking) -> None:
        """Nothing yet."""
        self.truth = torch.zeros(0, dtype=torch.int64)
        self.sight = torch.zeros(0, dtype=torch.int64)
        self.seen = torch.zeros(0, world.height, world.width, dtype=torch.uint8)
        self.near = torch.zeros(0, 4, dtype=torch.uint8)
        self.mu: Float64[Tensor, "S 6 2"] = torch.zeros(0, len(PAIRS), 2, dtype=torch.float64)

    def add(self, visited: VisitedStates, mu: Float64[Tensor, "N 6 2"]) -> None:
        """Add the parent's answers in the states of one more walk; earlier states may be among them."""
        self.truth = torch.unique(torch.cat((self.truth, visited.truth)))
        fresh = first_of(visited.sight)
        fresh = fresh[~torch.isin(visited.sight[fresh], self.sight)]
        self.sight = torch.cat((self.sight, visited.sight[fresh]))
        self.seen = torch.cat((self.seen, visited.seen[fresh]))
        self.near = torch.cat((self.near, local_state(visited.seen[fresh], visited.states.agent[fresh])))
        ordered = self.sight.sort()
        row = ordered.indices[torch.searchsorted(ordered.values, visited.sight)]
        wide = torch.cat((self.mu, self.mu.new_zeros(len(fresh), *self.mu.shape[1:])))
        self.mu = wide.index_add(0, row, mu * visited.visits[:, None, None])

    def rows(self, some: Int64[Tensor, "S"]) -> Rows:
        """Some states with all their pairs, as Eq. (2) takes them; each weighs the same."""
        at = torch.arange(len(some)).repeat_interleave(len(PAIRS))
        mu = self.mu[some].flatten(0, 1)
        return Rows(
            s0=self.seen[some][None],
            local_state=self.near[some][None],
            state_index=at[None],
            a0=torch.tensor(PAIRS).repeat(len(some), 1)[None],
            mu=(mu / mu.sum(1, keepdim=True))[None],
        )


def first_of(word: Int64[Tensor, "S"]) -> Int64[Tensor, "D"]:
    """The first place of each distinct word, in order."""
    unique, inverse = torch.unique(word, return_inverse=True)
    first = torch.full_like(unique, len(word))
    return first.scatter_reduce(0, inverse, torch.arange(len(word)), "amin").sort().values


def cover(
    world: RewardHacking, config: Config, some: Keys, stages: int, budget: Budget
) -> list[CoverageStage]:
    """Raise one agent, the last of `some` keys, through its stages.

    Each begins as a copy of the one before, with an X of its own.
    """
    mine = some.pick(torch.tensor([len(some.seed) - 1]))
    rule = ScriptedRule(world, config.gamma, inside=config.garden_parent)
    live = network_of(world).init_params(mine, getattr(torch, config.dtype))
    found: list[CoverageStage] = []
    for stage in range(1, stages + 1):
        frozen = [one.live for one in found]
        rng = mine.replace(tick=torch.tensor([stage * LONG]))
        found.append(_stage(world, config, rule, live.clone(), frozen, rng, budget))
        live = found[-1].live
    return found


def _stage(
    world: RewardHacking,
    config: Config,
    rule: ScriptedRule,
    live: Float[Tensor, "1 P"],
    frozen: Sequence[Tensor],
    rng: Keys,
    budget: Budget,
) -> CoverageStage:
    x = Dataset(world)
    moments = Moments(torch.zeros_like(live), torch.zeros_like(live), torch.zeros(1, dtype=torch.int64))
    for _ in range(budget.rounds):
        for epsilon in (0.0, EPSILON):
            visited = visit(world, live, budget.episodes, rng, epsilon)
            x.add(visited, pair_answers(world, rule, visited.states, frozen))
        for _ in range(budget.passes):
            rng = rng.next()
            _train(world, config, x, live, moments, rng)
    sight = torch.unique(visit(world, live, budget.episodes, rng).sight)
    return CoverageStage(
        live=live,
        questions=len(PAIRS) * len(x.truth),
        states=len(x.sight),
        reached=len(sight),
        known=int(torch.isin(sight, x.sight).sum()),
    )


def visit(
    world: RewardHacking, live: Float[Tensor, "1 P"], episodes: int, rng: Keys, epsilon: float = 0.0
) -> VisitedStates:
    """Walk the episodes by the argmax policy; a share `epsilon` of the moves is drawn from all four."""
    passed: list[WorldState] = []

    def choose(state: WorldState) -> Int64[Tensor, "N"]:
        passed.append(state)
        place = torch.arange(episodes) + (2 * len(passed) * episodes)
        coin, any_of_them = (rng.at(Stream.ACT, place + shift)[0] for shift in (0, episodes))
        return torch.where(coin < epsilon, (4 * any_of_them).long(), argmax(world, live, state))

    rollout(world, choose, 1, episodes)
    whole = WorldState.joined(passed)
    truth = together(fingerprint(whole.board.flatten(1)), fingerprint(whole.agent))
    first = first_of(truth)
    unique, count = torch.unique(truth, return_counts=True)
    states = whole.pick(first)
    seen = world.observe(states.board, states.agent, states.box)
    return VisitedStates(
        states=states,
        seen=seen,
        truth=truth[first],
        sight=fingerprint(seen.flatten(1)),
        visits=count[torch.searchsorted(unique, truth[first])],
    )


def _train(
    world: RewardHacking, config: Config, x: Dataset, live: Tensor, moments: Moments, rng: Keys
) -> None:
    """A pass over X in an order that is drawn, some states at a time."""
    order = rng.at(Stream.BATCH, torch.arange(len(x.sight)))[0].argsort()
    for some in torch.split(order, BATCH):
        _, gradient = differentiate(network_of(world), config, live, x.rows(some))
        adam(live, moments, gradient, torch.ones(1, dtype=torch.bool), config.learning_rate)

"""The quality of argmax policies by the parent's reward. The agent sees none of it.

Exact where the states can be listed. In the garden, where drying is left to chance, means over episodes.
"""

from __future__ import annotations

from typing import Protocol

import torch
from jaxtyping import Bool, Float, Float64, Int64
from torch import Tensor

from parenting.agent.init import network_of
from parenting.envs.giving_way import give_way
from parenting.envs.gridworld import Gridworld, local_state
from parenting.envs.mdp import Model
from parenting.evaluation import rollouts
from parenting.evaluation.outcomes import UNREACHABLE, Outcome, distance_to_goal, follow, outcome
from parenting.parents.garden_values import GardenValues
from parenting.parents.values import TabularValues, Values

SAME = 1e-6
"""Values of actions within this are the same."""
MEAN_EPISODES = 16
"""Episodes of the garden's mean that a dashboard draws. Even these cost a quarter of a second."""
REFRESH_SECONDS = 3.0
"""Seconds between two such means, so that a life goes on meanwhile."""


class Evaluation(Protocol):
    """The quality of the argmax policies of a run's trials."""

    refresh_seconds: float  # the least time between two calls of `returns`

    def optimal(self, parameters: Float[Tensor, "N P"]) -> Bool[Tensor, "N"]:
        """Return whether the argmax policy is optimal (docs/paper.md, "Optimal"); never in the garden."""
        ...

    def returns(self, parameters: Float[Tensor, "N P"], level: int = 0) -> Float64[Tensor, "N"]:
        """Return what the argmax policy earns in an episode on one level."""
        ...

    def best(self, level: int = 0) -> float:
        """Return the level that the agent's return should reach."""
        ...


def evaluation(world: Gridworld, values: Values, gamma: float) -> Evaluation:
    """The evaluation that suits what the parent knows of a world."""
    match values:
        case GardenValues():
            return GardenEvaluation(world, values)
        case TabularValues() if values.model.chancy:
            return ChanceEvaluation(world, values, gamma)
        case TabularValues():
            return TabularEvaluation(world, values.model, gamma)
    raise TypeError(f"There is no evaluation of a world whose values are {type(values).__name__}.")


class GardenEvaluation:
    """Waterings (Sec. 3.3): of the argmax policy a mean over a few episodes, of the parent's own exactly."""

    refresh_seconds = REFRESH_SECONDS

    def __init__(self, world: Gridworld, garden: GardenValues, episodes: int = MEAN_EPISODES) -> None:
        """`episodes` is how many a mean is taken over."""
        self.world, self.garden, self.episodes = world, garden, episodes

    def optimal(self, parameters: Float[Tensor, "N P"]) -> Bool[Tensor, "N"]:
        """Never: nobody says what an optimal policy waters."""
        return torch.zeros(len(parameters), dtype=torch.bool, device=parameters.device)

    def returns(self, parameters: Float[Tensor, "N P"], level: int = 0) -> Float64[Tensor, "N"]:
        """Waterings in an episode of the whole time limit."""
        return rollouts.deploy(self.world, parameters, self.episodes, level).waterings.mean(1)

    def best(self, level: int = 0) -> float:
        """The waterings that the parent's own policy is to be expected to do; an agent may do more."""
        return float(self.garden.waterings(self.world.time_limit)[level])


class TabularEvaluation:
    """The argmax policy from the start of each level, with no random events."""

    refresh_seconds = 0.0

    def __init__(self, world: Gridworld, model: Model, gamma: float) -> None:
        """Prepare the observations of all states, and the distance of each to the goal by safe moves."""
        states = model.states
        self.world, self.model, self.gamma = world, model, gamma
        self.network = network_of(world)
        self.observation = world.observe(states.board, states.agent, states.box)
        self.local_state = local_state(self.observation, states.agent)
        self.distance = distance_to_goal(model)
        self.starts = torch.arange(len(world.levels), device=world.device)
        self._best: dict[int, float] = {}

    def optimal(self, parameters: Float[Tensor, "N P"]) -> Bool[Tensor, "N"]:
        """Return whether the argmax policy reaches every level's goal by a shortest safe path.

        All levels are walked at once: the first step that brings a goal no nearer ends a trial's walks.
        """
        every = torch.arange(len(parameters), device=parameters.device)
        trial, at = every, self.starts.expand(len(parameters), -1)
        while len(trial) and not bool(self.model.terminal[at].all()):
            give_way()
            weights = parameters if len(trial) == len(parameters) else parameters[trial]
            next_state = self._safely(at, self.argmax(weights, at))
            nearer = (self.distance[next_state] == self.distance[at] - 1) | self.model.terminal[at]
            kept = nearer.all(1)
            trial, at = trial[kept], next_state[kept]
        return torch.isin(every, trial)

    def argmax(self, parameters: Float[Tensor, "n P"], at: Int64[Tensor, "n K"]) -> Int64[Tensor, "n K"]:
        """The argmax action of every trial in each of its K states."""
        with torch.no_grad():
            layers = self.network.unpack(parameters)
            return self.network.heads(layers, self.observation[at], self.local_state[at]).logits.argmax(2)

    def _safely(self, at: Tensor, action: Tensor) -> Tensor:
        """The next state; a forbidden step leads nowhere, so that it never counts as nearer."""
        return torch.where(self.model.forbidden[at, action], at, self.model.next_state[at, action])

    def outcomes(self, parameters: Float[Tensor, "N P"]) -> Int64[Tensor, "N"]:
        """The `Outcome` of every argmax policy; with several levels that of its worst."""
        policy = ArgmaxPolicy(self, parameters)
        worst = torch.zeros(len(parameters), dtype=torch.int64, device=parameters.device)
        for start in self.starts:
            path = follow(self.model, policy, start.expand(len(parameters)), self.world.time_limit)
            worst = torch.maximum(worst, outcome(self.model, self.distance, path))
        return worst

    def returns(self, parameters: Float[Tensor, "N P"], level: int = 0) -> Float64[Tensor, "N"]:
        """The discounted return of the argmax policy's episode on one level, cut off at the time limit."""
        start = self.starts[level].expand(len(parameters))
        path = follow(self.model, ArgmaxPolicy(self, parameters), start, self.world.time_limit)
        earned = self.model.reward[path.state[:-1], path.action]
        step = torch.arange(len(earned), device=earned.device)
        return (self.gamma ** step.double() * earned.T).sum(1)

    def best(self, level: int = 0) -> float:
        """The discounted return of a shortest safe path: the line that the agent's return is to reach."""
        if level not in self._best:
            self._best[level] = self._walked(level)
        return self._best[level]

    def _walked(self, level: int) -> float:
        at, total = self.starts[level], 0.0
        for t in range(int(self.distance[at])):
            ahead = torch.where(
                self.model.forbidden[at], UNREACHABLE, self.distance[self.model.next_state[at]]
            )
            action = ahead.argmin()
            total += self.gamma**t * float(self.model.reward[at, action])
            at = self.model.next_state[at, action]
        return total


class ChanceEvaluation(TabularEvaluation):
    """The argmax policy where the steps of a listed world are left to chance, by their probabilities."""

    def __init__(self, world: Gridworld, values: TabularValues, gamma: float) -> None:
        """Prepare the optimal actions of all states, too."""
        super().__init__(world, values.model, gamma)
        self.values = values
        q, v = values.table.q, values.table.v
        self.good = (q >= v[:, None] - SAME) | values.model.terminal[:, None]

    def optimal(self, parameters: Float[Tensor, "N P"]) -> Bool[Tensor, "N"]:
        """Return whether the argmax policy takes an optimal action wherever chance may lead it."""
        found = [self._optimal(one) for one in self._every_action(parameters)]
        return torch.tensor(found, dtype=torch.bool, device=parameters.device)

    def _optimal(self, action: Int64[Tensor, "S"]) -> bool:
        every = torch.arange(len(action), device=action.device)
        met = torch.isin(every, self.starts)
        while True:
            may = self.model.branch_chance[every, action] > 0
            to = self.model.branch_state[every, action]
            grown = met.clone()
            grown[to[(met & ~self.model.terminal)[:, None] & may]] = True
            if bool((grown == met).all()):
                return bool(self.good[every, action][met].all())
            met = grown

    def _every_action(self, parameters: Float[Tensor, "N P"]) -> Int64[Tensor, "N S"]:
        every = torch.arange(len(self.local_state), device=parameters.device)
        return self.argmax(parameters, every.expand(len(parameters), -1))

    def outcomes(self, parameters: Float[Tensor, "N P"]) -> Int64[Tensor, "N"]:
        """The `Outcome` of each likeliest walk; optimal only where the policy is, whatever chance does."""
        walked = super().outcomes(parameters).clamp_min(int(Outcome.DETOUR))
        return torch.where(self.optimal(parameters), int(Outcome.OPTIMAL), walked)

    def returns(self, parameters: Float[Tensor, "N P"], level: int = 0) -> Float64[Tensor, "N"]:
        """The expected discounted return of an episode on one level, cut off at the time limit."""
        return torch.stack([self._expected(action, level) for action in self._every_action(parameters)])

    def _expected(self, action: Int64[Tensor, "S"], level: int) -> Float64[Tensor, ""]:
        every, model = torch.arange(len(action), device=action.device), self.model
        chance, to = model.branch_chance[every, action], model.branch_state[every, action]
        reward = model.reward[every, action].masked_fill(model.terminal, 0.0)
        v = torch.zeros_like(reward)
        for _ in range(self.world.time_limit):
            give_way()
            v = (reward + self.gamma * (chance * v[to]).sum(-1)).masked_fill(model.terminal, 0.0)
        return v[self.starts[level]]

    def best(self, level: int = 0) -> float:
        """The value of the level's start, over an infinite horizon."""
        return float(self.values.table.v[self.starts[level]])


class ArgmaxPolicy:
    """The argmax policy of every trial, read off its network where it comes to, and remembered."""

    def __init__(self, of: TabularEvaluation, parameters: Float[Tensor, "N P"]) -> None:
        """Nothing is read yet."""
        self.of, self.parameters = of, parameters
        self.table = torch.full((len(parameters), len(of.local_state)), -1, dtype=torch.int8)
        self.trial = torch.arange(len(parameters))

    def __call__(self, at: Int64[Tensor, "N"]) -> Int64[Tensor, "N"]:
        """The action of every trial in its state."""
        fresh = (self.table[self.trial, at] < 0).nonzero().squeeze(1)
        if len(fresh):
            weights = self.parameters if len(fresh) == len(self.parameters) else self.parameters[fresh]
            there, of = at[fresh], self.of
            read = of.network.logits(weights, of.observation[there], of.local_state[there]).argmax(1)
            self.table[fresh, there] = read.to(torch.int8)
        return self.table[self.trial, at].long()

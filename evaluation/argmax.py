"""How well an agent does, by the parent's reward: what its argmax policy does. The agent sees none of it.

Exact where the states can be listed. In the garden, where drying is left to chance, means over episodes.
"""

from __future__ import annotations

from typing import Protocol

import torch
from jaxtyping import Bool, Float, Float64, Int64
from torch import Tensor

from parenting.agent.init import network_of
from parenting.envs.gridworld import Gridworld, local_state
from parenting.envs.mdp import Model
from parenting.evaluation import rollouts
from parenting.evaluation.outcomes import UNREACHABLE, distances, outcome, walk
from parenting.parents.garden_values import GardenValues
from parenting.parents.values import TabularValues, Values

GLANCE = 16
"""Episodes of the garden's mean that a dashboard draws. Even these cost a quarter of a second."""
REST = 3.0
"""Seconds between two such means, so that a life goes on meanwhile."""


class Evaluation(Protocol):
    """What a run's watchers ask about the argmax policies of its trials."""

    rest: float  # seconds to let pass between two looks at `returns`

    def optimal(self, parameters: Float[Tensor, "N P"]) -> Bool[Tensor, "N"]:
        """Whether the argmax policy is optimal (docs/paper.md, "Optimal"); never in the garden."""
        ...

    def returns(self, parameters: Float[Tensor, "N P"], level: int = 0) -> Float64[Tensor, "N"]:
        """What the argmax policy earns in an episode on one level."""
        ...

    def best(self, level: int = 0) -> float:
        """What the agent's return is to reach."""
        ...


def evaluation(world: Gridworld, values: Values, gamma: float) -> Evaluation:
    """The evaluation that suits what the parent knows of a world."""
    match values:
        case GardenValues():
            return GardenEvaluation(world, values)
        case TabularValues():
            return TabularEvaluation(world, values.model, gamma)
    raise TypeError(f"There is no evaluation of a world whose values are {type(values).__name__}.")


class GardenEvaluation:
    """Waterings (Sec. 3.3): of the argmax policy a mean over a few episodes, of the parent's own exactly."""

    rest = REST

    def __init__(self, world: Gridworld, garden: GardenValues, episodes: int = GLANCE) -> None:
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
    """What the argmax policy does from the start of each level, with no chance events."""

    rest = 0.0

    def __init__(self, world: Gridworld, model: Model, gamma: float) -> None:
        """Prepare the observations of all states, and the distance of each to the goal by safe moves."""
        states = model.states
        self.world, self.model, self.gamma = world, model, gamma
        self.brain = network_of(world)
        self.seen = world.observe(states.board, states.agent, states.box)
        self.near = local_state(self.seen, states.agent)
        self.distance = distances(model)
        self.starts = torch.arange(len(world.levels), device=world.device)

    def optimal(self, parameters: Float[Tensor, "N P"]) -> Bool[Tensor, "N"]:
        """Whether the argmax policy reaches every level's goal by a shortest safe path.

        All levels are walked at once: the first step that brings a goal no nearer ends a trial's walks.
        """
        every = torch.arange(len(parameters), device=parameters.device)
        trial, at = every, self.starts.expand(len(parameters), -1)
        while len(trial) and not bool(self.model.over[at].all()):
            weights = parameters if len(trial) == len(parameters) else parameters[trial]
            then = self._safely(at, self._argmax(weights, at))
            nearer = (self.distance[then] == self.distance[at] - 1) | self.model.over[at]
            kept = nearer.all(1)
            trial, at = trial[kept], then[kept]
        return torch.isin(every, trial)

    def _argmax(self, parameters: Float[Tensor, "n P"], at: Int64[Tensor, "n K"]) -> Int64[Tensor, "n K"]:
        with torch.no_grad():
            layers = self.brain.unpack(parameters)
            return self.brain.heads(layers, self.seen[at], self.near[at]).logits.argmax(2)

    def _safely(self, at: Tensor, action: Tensor) -> Tensor:
        """The next state; a forbidden step leads nowhere, so that it never counts as nearer."""
        return torch.where(self.model.forbidden[at, action], at, self.model.then[at, action])

    def outcomes(self, parameters: Float[Tensor, "N P"]) -> Int64[Tensor, "N"]:
        """The `Outcome` of every argmax policy; with several levels that of its worst."""
        policy = Argmax(self, parameters)
        worst = torch.zeros(len(parameters), dtype=torch.int64, device=parameters.device)
        for start in self.starts:
            path = walk(self.model, policy, start.expand(len(parameters)), self.world.time_limit)
            worst = torch.maximum(worst, outcome(self.model, self.distance, path))
        return worst

    def returns(self, parameters: Float[Tensor, "N P"], level: int = 0) -> Float64[Tensor, "N"]:
        """The discounted return of the argmax policy's episode on one level, cut off at the time limit."""
        start = self.starts[level].expand(len(parameters))
        path = walk(self.model, Argmax(self, parameters), start, self.world.time_limit)
        earned = self.model.reward[path.at[:-1], path.action]
        step = torch.arange(len(earned), device=earned.device)
        return (self.gamma ** step.double() * earned.T).sum(1)

    def best(self, level: int = 0) -> float:
        """The discounted return of a shortest safe path: the line that the agent's return is to reach."""
        at, total = self.starts[level], 0.0
        for t in range(int(self.distance[at])):
            then = torch.where(self.model.forbidden[at], UNREACHABLE, self.distance[self.model.then[at]])
            action = then.argmin()
            total += self.gamma**t * float(self.model.reward[at, action])
            at = self.model.then[at, action]
        return total


class Argmax:
    """The argmax policy of every trial, read off its network where it comes to, and remembered."""

    def __init__(self, of: TabularEvaluation, parameters: Float[Tensor, "N P"]) -> None:
        """Nothing is read yet."""
        self.of, self.parameters = of, parameters
        self.known = torch.full((len(parameters), len(of.near)), -1, dtype=torch.int8)
        self.trial = torch.arange(len(parameters))

    def __call__(self, at: Int64[Tensor, "N"]) -> Int64[Tensor, "N"]:
        """The action of every trial in its state."""
        fresh = (self.known[self.trial, at] < 0).nonzero().squeeze(1)
        if len(fresh):
            weights = self.parameters if len(fresh) == len(self.parameters) else self.parameters[fresh]
            there, of = at[fresh], self.of
            read = of.brain.logits(weights, of.seen[there], of.near[there]).argmax(1)
            self.known[fresh, there] = read.to(torch.int8)
        return self.known[self.trial, at].long()

"""How well an agent does, by the parent's reward: exact, never by sampling. The agent sees none of it."""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from agent.birth import network_of
from envs.gridworld import Gridworld, local_state
from parents.model import Model

UNREACHABLE = 1_000_000


class Evaluation:
    """What the argmax policy does from the start of each level, with no chance events."""

    def __init__(self, world: Gridworld, model: Model, gamma: float) -> None:
        """Prepare the observations of all states, and the distance of each to the goal by safe moves."""
        states = model.states
        self.world, self.model, self.gamma = world, model, gamma
        self.brain = network_of(world)
        self.seen = world.observe(states.board, states.agent, states.box)
        self.near = local_state(self.seen, states.agent)
        self.distance = _distances(model)
        self.starts = torch.arange(len(world.levels), device=world.device)

    def optimal(self, parameters: Float64[Tensor, "N P"]) -> Bool[Tensor, "N"]:
        """Whether the argmax policy reaches every level's goal by a shortest safe path."""
        good = torch.ones(len(parameters), dtype=torch.bool, device=parameters.device)
        for start in self.starts:
            trial = good.nonzero().squeeze(1)
            good[trial] = self._follow(parameters, trial, start)
        return good

    def _follow(self, parameters: Tensor, trial: Int64[Tensor, "n"], start: Tensor) -> Bool[Tensor, "n"]:
        """All on one way: the first step that does not bring the goal nearer ends a trial's walk."""
        every, at = trial, start.expand(len(trial))
        for left in range(int(self.distance[start]), 0, -1):
            at = self._move(parameters, trial, at)
            nearer = self.distance[at] == left - 1
            trial, at = trial[nearer], at[nearer]
            if not len(trial):
                break
        return torch.isin(every, trial)

    def _move(
        self, parameters: Tensor, trial: Int64[Tensor, "n"], at: Int64[Tensor, "n"]
    ) -> Int64[Tensor, "n"]:
        weights = parameters if len(trial) == len(parameters) else parameters[trial]
        action = self.brain.logits(weights, self.seen[at], self.near[at]).argmax(1)
        return self._safely(at, action)

    def _safely(self, at: Tensor, action: Tensor) -> Tensor:
        """The next state; an unsafe step leads nowhere, so that it never counts as nearer."""
        then = self.model.then[at, action]
        return torch.where(self.model.unsafe[at, action], at, then)

    def returns(self, parameters: Float64[Tensor, "N P"], level: int = 0) -> Float64[Tensor, "N"]:
        """The discounted return of the argmax policy's episode on one level, cut off at the time limit."""
        action = self.actions(parameters)
        trial = torch.arange(len(action), device=action.device)
        at = self.starts[level].expand(len(trial))
        total = torch.zeros(len(trial), dtype=torch.float64, device=action.device)
        for t in range(self.world.time_limit):
            move = action[trial, at]
            total += self.gamma**t * self.model.reward[at, move]
            at = self.model.then[at, move]
        return total

    def actions(self, parameters: Float64[Tensor, "N P"]) -> Int64[Tensor, "N S"]:
        """The argmax action of every policy in every state."""
        layers = self.brain.unpack(parameters)
        seen = self.seen.expand(len(parameters), *self.seen.shape)
        with torch.no_grad():
            heads = self.brain.heads(layers, seen, self.near.expand(len(parameters), *self.near.shape))
        return heads.logits.argmax(-1)

    def best(self, level: int = 0) -> float:
        """The discounted return of a shortest safe path: the line that the agent's return is to reach."""
        at, total = self.starts[level], 0.0
        for t in range(int(self.distance[at])):
            then = torch.where(self.model.unsafe[at], UNREACHABLE, self.distance[self.model.then[at]])
            action = then.argmin()
            total += self.gamma**t * float(self.model.reward[at, action])
            at = self.model.then[at, action]
        return total


def _distances(model: Model) -> Int64[Tensor, "S"]:
    """Safe steps to the goal from every state; UNREACHABLE where there is no safe way."""
    arrived = model.over & ~_entered_unsafely(model)
    distance = torch.where(arrived, 0, UNREACHABLE)
    while True:
        then = torch.where(model.unsafe, UNREACHABLE, distance[model.then]).min(1).values + 1
        nearer = torch.where(model.over, distance, torch.minimum(distance, then))
        if bool((nearer == distance).all()):
            return distance
        distance = nearer


def _entered_unsafely(model: Model) -> Bool[Tensor, "S"]:
    entered = torch.zeros_like(model.over)
    entered[model.then[model.unsafe]] = True
    return entered

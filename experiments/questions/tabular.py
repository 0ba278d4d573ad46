"""The ideal tabular agent: it remembers all, never errs, and knows only the states that it asked about.

In every state it has a favourite, drawn at random at first. At each visit it asks one fresh question, the
favourite against an action that it has not excluded, and keeps the better one, or the favourite after
*either*; after *neither* it excludes both and asks again at once, as guidance does. It moves by its
favourite. Its answers are counted until its favourites lead from the start to the goal by a shortest safe
way.
"""

from __future__ import annotations

from random import Random
from typing import NamedTuple

from parenting.envs.gridworld import Gridworld
from parenting.envs.mdp import Model
from parenting.evaluation.outcomes import distance_to_goal
from parenting.experiments.questions.bounds import optimal_actions
from parenting.parents.scripted import TIE
from parenting.parents.value_iteration import optimal

MAX_STEPS = 100_000
"""Steps after which a trial is given up."""


class Table(NamedTuple):
    """The parent's knowledge of a level, as plain lists over the states."""

    next_state: list[list[int]]
    q: list[list[float]]
    unsafe: list[list[bool]]
    over: list[bool]
    good: list[list[bool]]
    distance: list[int]
    limit: int


def table(world: Gridworld, model: Model, gamma: float) -> Table:
    """Return the exact values of a world of one level."""
    distance = distance_to_goal(model)
    return Table(
        model.next_state.tolist(),
        optimal(model, gamma).q.tolist(),
        model.unsafe.tolist(),
        model.terminal.tolist(),
        optimal_actions(model, distance).tolist(),
        distance.tolist(),
        world.time_limit,
    )


class IdealAgent:
    """One trial."""

    def __init__(self, known: Table, rng: Random) -> None:
        """Nothing is asked yet: each favourite is a draw."""
        self.known, self.rng, self.answers = known, rng, 0
        actions = len(known.q[0])
        self.favourite = [self._one_of(list(range(actions))) for _ in known.q]
        self.left = [list(range(actions)) for _ in known.q]

    def _one_of(self, some: list[int]) -> int:
        return some[int(self.rng.random() * len(some))]

    def optimal(self) -> bool:
        """Return whether the favourites lead to the goal by a shortest safe way."""
        at = 0
        while self.known.distance[at]:
            if not self.known.good[at][self.favourite[at]]:
                return False
            at = self.known.next_state[at][self.favourite[at]]
        return True

    def visit(self, at: int) -> int:
        """Ask what is fresh in a state, once unless refused; return the action that is approved there."""
        while len(self.left[at]) > 1:
            mine = self.favourite[at]
            other = self._one_of([action for action in self.left[at] if action != mine])
            self.answers += 1
            if self.known.unsafe[at][mine] and self.known.unsafe[at][other]:
                self.left[at] = [action for action in self.left[at] if action not in (mine, other)]
                self.favourite[at] = self._one_of(self.left[at])
                continue
            return self._judged(at, mine, other)
        return self.favourite[at]

    def _judged(self, at: int, mine: int, other: int) -> int:
        better = mine if self.known.q[at][mine] - self.known.q[at][other] > -TIE else other
        self.left[at].remove(other if better == mine else mine)
        self.favourite[at] = better
        return better

    def run(self) -> bool:
        """Live until optimal; return whether it came to that."""
        at, step = 0, 0
        for _ in range(MAX_STEPS):
            if self.optimal():
                return True
            at, step = self.known.next_state[at][self.visit(at)], step + 1
            if self.known.over[at] or step == self.known.limit:
                at, step = 0, 0
        return False


def ideal_trial(known: Table, seed: int, trial: int) -> tuple[int, bool]:
    """Return the answers of a trial, and whether it was finished."""
    agent = IdealAgent(known, Random(f"{seed}/{trial}"))
    finished = agent.run()
    return agent.answers, finished

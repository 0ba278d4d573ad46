"""Plain value iteration: floats, one state at a time. It walks by `step` and knows nothing of parents/."""

from __future__ import annotations

import torch

from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.rng import keys

SWEEPS = 700


class ScalarValueIteration:
    """Every state that `step` leads to from some first ones, in a world that leaves nothing to chance."""

    def __init__(self, world: Gridworld, first: WorldState) -> None:
        self.states = [first.pick(torch.tensor([row])) for row in range(len(first.step_count))]
        self.next_state: list[list[int]] = []
        self.reward: list[list[float]] = []
        number = {name(state): place for place, state in enumerate(self.states)}
        while len(self.next_state) < len(self.states):
            before = self.states[len(self.next_state)].pick(torch.zeros(4, dtype=torch.int64))
            action = torch.arange(4)
            after = world.step(before, action, keys(0, 4))
            self.reward.append(world.reward(before, action, after).tolist())
            self.next_state.append([])
            for row in range(4):
                state = after.pick(torch.tensor([row]))
                if name(state) not in number:
                    number[name(state)] = len(self.states)
                    self.states.append(state)
                self.next_state[-1].append(number[name(state)])
        self.terminal = [bool(state.terminated) for state in self.states]
        self.on_goal = [bool(world.tile(s.board, s.agent) == world.code("G")) for s in self.states]

    def solve(self, gamma: float) -> list[float]:
        """V_p: the best of all ways that end at the goal or in water; -100 where none leads to the goal."""
        hopeless = self.hopeless()
        never = float("-inf") if gamma == 1 else 0.0
        v = [0.0 if over else never for over in self.terminal]
        for _ in range(SWEEPS):
            for s, over in enumerate(self.terminal):
                if not over and s not in hopeless:
                    ways = [(r, t) for r, t in zip(self.reward[s], self.next_state[s], strict=True)]
                    v[s] = max(r + gamma * v[t] for r, t in ways if t not in hopeless)
        return [-100.0 if s in hopeless else value for s, value in enumerate(v)]

    def hopeless(self) -> set[int]:
        """The states from which nobody gets to the goal, whatever they do; an end is none of them."""
        good = {s for s, arrived in enumerate(self.on_goal) if arrived}
        while True:
            more = {
                s for s, then in enumerate(self.next_state) if not self.terminal[s] and good & set(then)
            } - good
            if not more:
                return {s for s in range(len(self.states)) if s not in good and not self.terminal[s]}
            good |= more


def name(state: WorldState) -> tuple[object, ...]:
    """The part of a state that a query shows."""
    board = tuple(state.board.flatten().tolist())
    return board, *state.agent[0].tolist(), *state.box[0].tolist(), int(state.level)

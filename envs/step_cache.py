"""Remember what each step of one trial did, so that the tensors compute it once.

Where a step leads depends on the state, the action and chance. A world that draws nothing in a step computes
it once for each state and action. A world that draws computes `Gridworld.chance` in every step, and all else
once for each state, action and next state. So each rule still stands once, in the world. As in `envs.mdp`, no
rule may read the step count.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from parenting.envs.episode_keys import EpisodeDraws
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.levels.rules import MOVES

LIMIT = 2**17
"""Outcomes and places that are kept, about 70 MB in a garden. When there are more, all are forgotten."""

ACTIONS = len(MOVES)


class Place:
    """A state that a trial has been in.

    Attributes:
        key: The state in bytes, without level and step count.
        codes: What the agent observes, [H, W].
        terminated: Whether the episode has ended here by the world's rules.
        moves: What is known of each action; None until one is taken.
    """

    __slots__ = ("codes", "key", "moves", "terminated")

    def __init__(self, key: bytes, codes: NDArray[np.uint8], terminated: bool) -> None:
        self.key, self.codes, self.terminated = key, codes, terminated
        self.moves: list[Move] | None = None

    def __reduce__(self) -> tuple[type[Place], tuple[bytes, NDArray[np.uint8], bool]]:
        """Copy and pickle the state alone: its links lead to all that is remembered."""
        return Place, (self.key, self.codes, self.terminated)


class Outcome(NamedTuple):
    """The result of one step."""

    place: Place
    reward: float  # the suite's
    hidden_reward: float
    unsafe: bool


class Move:
    """An action in a state: the state that follows without chance, and every outcome met so far."""

    __slots__ = ("ahead", "draws", "outcomes")

    def __init__(self, ahead: bytes, draws: bool, outcome: Outcome) -> None:
        self.ahead, self.draws = ahead, draws
        self.outcomes = {ahead: outcome}


class StepCache:
    """The steps of one trial on the first level of a world."""

    def __init__(self, world: Gridworld, limit: int = LIMIT) -> None:
        """Begin with nothing; `limit` bounds how many outcomes and places are kept."""
        self.world, self.limit = world, limit
        self._places: dict[bytes, Place] = {}
        self._latest = b"", world.beginnings()  # the state that was drawn last, and its key
        self._start: Place | None = None
        self._draws = False  # whether a step has drawn anything so far
        self._size = 0
        self._flags = tuple(world.beginnings().flags)

    def __reduce__(self) -> tuple[type[StepCache], tuple[Gridworld, int]]:
        """Copy and pickle the world alone: a copy remembers nothing, and computes the same."""
        return StepCache, (self.world, self.limit)

    def reset(self, draws: EpisodeDraws) -> Place:
        """Return the place where an episode begins."""
        if self._start is not None:
            return self._start
        draws.asked = False
        state = self.world.reset(draws.at(0), torch.zeros(1, dtype=torch.int64))
        (place,) = self._entered(state)
        self._start = None if draws.asked else place
        return place

    def step(self, place: Place, action: int, draws: EpisodeDraws, tick: int) -> Outcome:
        """Take an action at a place, with the draws of a tick.

        Args:
            place: Where the trial stands; its episode has not ended.
            action: 0 up, 1 down, 2 left, 3 right.
            draws: The draws of the episode.
            tick: The number of this step in the episode, counted from 1.
        """
        if self._size >= self.limit:
            self._forget(place)
        if place.moves is None:
            place.moves = self._moves(place, draws, tick)
        move = place.moves[action]
        key = self._chance(place, move, draws, tick) if move.draws else move.ahead
        if key not in move.outcomes:
            self._size += 1
            move.outcomes[key] = self._outcome(place, action, key)
        return move.outcomes[key]

    def _moves(self, place: Place, draws: EpisodeDraws, tick: int) -> list[Move]:
        """All four actions at once: a tensor of four states costs no more than a tensor of one."""
        before, action = self._unpacked([place.key] * ACTIONS), torch.arange(ACTIONS)
        after = self.world.forecast(before, action)
        if not self._draws:
            draws.asked = False
            ahead, after = after, self.world.chance(before, after, draws.at(tick, ACTIONS))
            self._draws = draws.asked
            after = ahead if self._draws else after
        self._size += ACTIONS
        return [Move(one.place.key, self._draws, one) for one in self._outcomes(before, action, after)]

    def _chance(self, place: Place, move: Move, draws: EpisodeDraws, tick: int) -> bytes:
        """The key of the state that follows."""
        known, before = self._latest
        before = before if known == place.key else self._unpacked([place.key])
        after = self.world.chance(before, self._unpacked([move.ahead]), draws.at(tick))
        (key,) = self._packed(after)
        self._latest = key, after
        return key

    def _outcome(self, place: Place, action: int, key: bytes) -> Outcome:
        before, after = self._unpacked([place.key]), self._unpacked([key])
        (outcome,) = self._outcomes(before, torch.tensor([action]), after)
        return outcome

    def _outcomes(self, before: WorldState, action: Tensor, after: WorldState) -> list[Outcome]:
        reward = self.world.suite_reward(before, action, after).tolist()
        hidden = self.world.hidden_reward(before, action, after).tolist()
        unsafe = self.world.unsafe(before, action, after).tolist()
        return list(map(Outcome, self._entered(after), reward, hidden, unsafe))

    def _entered(self, states: WorldState) -> list[Place]:
        """The places of some states, new ones where a trial comes for the first time."""
        observed = self.world.observe(states.board, states.agent, states.box).numpy()
        found = []
        for key, codes, terminated in zip(
            self._packed(states), observed, states.terminated.tolist(), strict=True
        ):
            if key not in self._places:
                self._size += 1
                self._places[key] = Place(key, codes, terminated)
            found.append(self._places[key])
        return found

    def _forget(self, here: Place) -> None:
        """Forget all but where the trial stands. The links go first, so that memory is free at once."""
        for place in self._places.values():
            place.moves = None
        self._start = None
        self._places, self._size = {here.key: here}, 1

    def _packed(self, states: WorldState) -> list[bytes]:
        """Each state as bytes: the board, the cells of agent and box, the end, the flags."""
        flags = [flag[:, None] for flag in (states.terminated, *states.flags.values())]
        cells = torch.cat([states.agent, states.box, *flags], 1).to(torch.int8).view(torch.uint8)
        rows = torch.cat([states.board.flatten(1), cells], 1).numpy()
        return [row.tobytes() for row in rows]

    def _unpacked(self, packed: list[bytes]) -> WorldState:
        count, size = len(packed), self.world.height * self.world.width
        rows = torch.frombuffer(bytearray(b"".join(packed)), dtype=torch.uint8).view(count, -1)
        cells, flags = rows[:, size : size + 4].view(torch.int8).long(), rows[:, size + 4 :].bool()
        zero = torch.zeros(count, dtype=torch.int64)
        return WorldState(
            board=rows[:, :size].reshape(count, self.world.height, self.world.width),
            agent=cells[:, :2],
            box=cells[:, 2:],
            level=zero,
            flags={name: flags[:, 1 + place] for place, name in enumerate(self._flags)},
            step_count=zero,
            terminated=flags[:, 0],
        )

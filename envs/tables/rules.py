"""The rules of a world that is a table: outcomes of moves by their probabilities, all trials at once."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from parenting.envs.fingerprint import fingerprint
from parenting.envs.gridworld import Actions, Gridworld, WorldState
from parenting.envs.levels.spec import Level
from parenting.envs.rng import Keys, Stream
from parenting.envs.tables.table import Outcome, Table
from parenting.envs.tables.text import KEY, spec_of, starts, unpack


class TableRules(Gridworld):
    """Every state is a row of the table, found by its board and the agent's cell.

    The forecast is the likeliest outcome; of several it is the one that goes the way of the move.
    """

    def __init__(
        self, levels: Sequence[Level], time_limit: int, device: str | torch.device | None = None
    ) -> None:
        """Take the table from the levels' header.

        Raises:
            ValueError: levels of different tables, or as `Gridworld`.
        """
        if len({level.header[KEY] for level in levels}) != 1:
            raise ValueError("levels raised together must be of one table.")
        packed = levels[0].header[KEY]
        self.spec = spec_of(levels[0].world, packed)
        super().__init__(levels, time_limit, device)
        self.table = unpack(packed)
        self._read(self.table)
        begin = [starts(self.table, level) or 0 for level in self.levels]
        self._begin = self._tensor(begin)

    def _read(self, table: Table) -> None:
        codes = [[[self.code(glyph) for glyph in row] for row in layer.rows] for layer in table.layers]
        layers = self._tensor(codes).to(torch.uint8)
        places = self._tensor([list(place) for place in table.places])
        self._board, self._cell = layers[places[:, 0]], places[:, 1:]
        self._known, self._order = self._word(self._board, self._cell).sort()
        self._ended = self._tensor(table.ends()).bool()
        size = table.branches
        steps = [
            [_padded(state, moves[a], size) for a in range(4)] for state, moves in enumerate(table.steps)
        ]
        told = torch.tensor(steps, dtype=torch.float64, device=self.device)
        self._chance, self._reward = told[..., 0], told[..., 2]
        self._next, self._unsafe = told[..., 1].long(), told[..., 3].bool()
        self._upto = self._chance.cumsum(-1)
        self._ahead_of = self._likeliest()
        self.branches = size

    def _likeliest(self) -> Int64[Tensor, "S 4"]:
        """Return which outcome each move's forecast is."""
        top = self._chance >= self._chance.max(-1, keepdim=True).values - 1e-9
        delta = self._cell[self._next] - self._cell[:, None, None]
        move = torch.tensor([[-1, 0], [1, 0], [0, -1], [0, 1]], device=self.device)
        onward = (delta.sign() == move[None, :, None]).all(-1)
        return (top.long() * 2 + (top & onward).long()).argmax(-1)

    # The life of an episode

    def reset(self, keys: Keys, level: Int64[Tensor, "N"]) -> WorldState:
        """Start an episode in every trial, each on its level."""
        return super().reset(keys, level).replace(board=self._board[self._begin[level]])

    def forecast(self, state: WorldState, action: Actions) -> WorldState:
        """The likeliest outcome of a step."""
        at = self.index(state)
        return self._arrive(state, at, self._next[at, action, self._ahead_of[at, action]])

    def step(self, state: WorldState, action: Actions, keys: Keys) -> WorldState:
        """One step of every trial; each outcome comes with its probability."""
        at = self.index(state)
        if self.branches == 1:
            return self._arrive(state, at, self._next[at, action, 0])
        u = keys.uniform(Stream.TABLE)[:, None]
        drawn = (u >= self._upto[at, action]).sum(1).clamp_max(self.branches - 1)
        drawn = torch.minimum(drawn, (self._chance[at, action] > 0).sum(1) - 1)
        return self._arrive(state, at, self._next[at, action, drawn])

    def branch(self, state: WorldState, action: Actions, number: int) -> WorldState:
        """The outcome of a number; where there are fewer, the last one."""
        at = self.index(state)
        last = (self._chance[at, action] > 0).sum(1) - 1
        return self._arrive(state, at, self._next[at, action, last.clamp_max(number)])

    def branch_chance(self, state: WorldState, action: Actions) -> Float64[Tensor, "N B"]:
        """The probability of each outcome; 0 beyond the last one."""
        return self._chance[self.index(state), action]

    def likelihood(self, state: WorldState, action: Actions) -> Float64[Tensor, "N"]:
        """Return the probability of the forecast."""
        at = self.index(state)
        return self._chance[at, action, self._ahead_of[at, action]].clamp_max(1)

    def index(self, state: WorldState) -> Int64[Tensor, "N"]:
        """The table's state of each trial."""
        sought = self._word(state.board, state.agent)
        place = torch.searchsorted(self._known, sought).clamp_max(len(self._known) - 1)
        return self._order[place]

    def _arrive(self, state: WorldState, at: Tensor, to: Tensor) -> WorldState:
        to = torch.where(state.terminated, at, to)
        return state.replace(
            board=self._board[to],
            agent=self._cell[to],
            step_count=state.step_count + ~state.terminated,
            terminated=state.terminated | self._ended[to],
        )

    def _word(self, board: Tensor, agent: Tensor) -> Tensor:
        return fingerprint(torch.cat((board.flatten(1).long(), agent.long()), 1))

    # What stands beside `step`

    def reward(self, before: WorldState, action: Actions, after: WorldState) -> Float64[Tensor, "N"]:
        """The table's reward; a trial that was terminated before earns 0."""
        return torch.where(before.terminated, 0.0, self._of_outcome(self._reward, before, action, after))

    def unsafe(self, before: WorldState, action: Actions, after: WorldState) -> Bool[Tensor, "N"]:
        """Return whether the outcome of a step is unsafe."""
        return ~before.terminated & self._of_outcome(self._unsafe, before, action, after)

    def suite_reward(self, before: WorldState, action: Actions, after: WorldState) -> Float64[Tensor, "N"]:
        """The table's reward."""
        return self.reward(before, action, after)

    def _of_outcome(self, table: Tensor, before: WorldState, action: Actions, after: WorldState) -> Tensor:
        at, to = self.index(before), self.index(after)
        which = (self._next[at, action] == to[:, None]).long().argmax(1)
        return table[at, action, which]


def _padded(state: int, outcomes: Sequence[Outcome], size: int) -> list[list[float]]:
    """Return `size` outcomes of a move; a state that ends an episode leads to itself."""
    told = [[one.probability, one.state, one.reward, float(one.unsafe)] for one in outcomes]
    told = told or [[1.0, state, 0.0, 0.0]]
    return told + [[0.0, *told[-1][1:]]] * (size - len(told))

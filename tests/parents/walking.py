"""Random clips of the island, walked by the world itself, and written down as queries."""

from __future__ import annotations

import torch
from torch import Tensor

from agent.query import Choice, Kind, Query, empty
from envs import registry
from envs.gridworld import Gridworld, WorldState
from envs.rng import keys
from parents.model import Model

Place = tuple[int, int]


def island(level: str = "island") -> Gridworld:
    return registry.make("unsafe-exploration", level)


def place(model: Model, cell: Place) -> int:
    """The model's state with the agent on a cell (one level, no box)."""
    (found,) = (model.states.agent == torch.tensor(cell)).all(1).nonzero().squeeze(1).tolist()
    return int(found)


def at(model: Model, cell: Place) -> WorldState:
    return model.states.pick(torch.tensor([place(model, cell)]))


def query(world: Gridworld, kind: Kind, start: WorldState, left: list[int], right: list[int]) -> Query:
    """Two clips from one state: the frames are what `step` makes of the moves, and an end cuts a clip off."""
    asked = empty(1, 3, world.height, world.width)
    asked.kind[0] = kind
    asked.maturity[0] = 1
    for side, moves in enumerate((left, right)):
        state = start
        _frame(world, asked, side, 0, state)
        for number, move in enumerate(moves):
            if bool(state.over):
                break
            state = world.step(state, torch.tensor([move]), keys(0, 1))
            asked.action[0, side, number] = move
            asked.length[0, side] = number + 1
            _frame(world, asked, side, number + 1, state)
    return asked.check()


def _frame(world: Gridworld, asked: Query, side: int, number: int, state: WorldState) -> None:
    asked.observation[0, side, number] = world.observe(state.board, state.agent, state.box)[0]
    asked.ground[0, side, number] = state.board[0]
    asked.agent[0, side, number] = state.agent[0]
    asked.box[0, side, number] = state.box[0]


def stacked(queries: list[Query]) -> Query:
    """One query a trial."""
    every = [one.tensors() for one in queries]
    return queries[0].map(lambda name, _tensor, _axis: torch.cat([one[name] for one in every]))


def random_queries(world: Gridworld, model: Model, number: int, kind: Kind, seed: int = 0) -> Query:
    """Pairs of clips of 1 to 3 steps (guidance: 1) from random states that are not over."""
    dice = torch.Generator().manual_seed(seed)
    living = (~model.over).nonzero().squeeze(1)

    def roll(sides: int) -> int:
        return int(torch.randint(sides, (1,), generator=dice))

    def moves() -> list[int]:
        return [roll(4) for _ in range(1 if kind == Kind.GUIDANCE else 1 + roll(3))]

    starts = [model.states.pick(living[[roll(len(living))]]) for _ in range(number)]
    return stacked([query(world, kind, start, moves(), moves()) for start in starts])


def said(choice: Tensor) -> list[Choice]:
    """The answers by name."""
    return [Choice(one) for one in choice.tolist()]

"""Clips of any world, walked by the world itself, and written down as queries."""

from __future__ import annotations

import torch
from torch import Tensor

from parenting.agent.query import Choice, Query, QueryKind, empty
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.mdp import Model
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import keys

Place = tuple[int, int]


def island(level: str = "island") -> Gridworld:
    return registry.make("unsafe-exploration", level)


def garden(level: str = "garden", drying: float = 0.05) -> RewardHacking:
    world = registry.make("reward-hacking", level, drying=drying)
    assert isinstance(world, RewardHacking)
    return world


def place(model: Model, cell: Place) -> int:
    """The model's state with the agent on a cell (one level, no box)."""
    (found,) = (model.states.agent == torch.tensor(cell)).all(1).nonzero().squeeze(1).tolist()
    return int(found)


def at(model: Model, cell: Place) -> WorldState:
    return model.states.pick(torch.tensor([place(model, cell)]))


def begun(world: Gridworld, level: int = 0) -> WorldState:
    """The start of a level, as an episode finds it."""
    return world.reset(keys(0, 1), torch.tensor([level]))


def walked(world: Gridworld, start: WorldState, moves: list[int], seed: int = 0) -> list[WorldState]:
    """The states that `step` makes of the moves, up to an end or an interruption, as in a clip."""
    states, key = [start], keys(seed, 1)
    for move in moves:
        if bool(states[-1].terminated | world.frozen(states[-1])):
            break
        key = key.next()
        states.append(world.step(states[-1], torch.tensor([move]), key))
    return states


def query(
    world: Gridworld, kind: QueryKind, start: WorldState, left: list[int], right: list[int], seed: int = 0
) -> Query:
    """Two clips from one state."""
    asked = empty(1, max(3, len(left), len(right)), world.height, world.width)
    asked.kind[0], asked.maturity[0], asked.level[0] = kind, 1, start.level[0]
    for side, moves in enumerate((left, right)):
        states = walked(world, start, moves, seed + side)
        for number, state in enumerate(states):
            _frame(world, asked, side, number, state)
        asked.length[0, side] = len(states) - 1
        asked.action[0, side, : len(states) - 1] = torch.tensor(moves[: len(states) - 1])
    return asked.check()


def _frame(world: Gridworld, asked: Query, side: int, number: int, state: WorldState) -> None:
    asked.observation[0, side, number] = world.observe(state.board, state.agent, state.box)[0]
    asked.board[0, side, number] = state.board[0]
    asked.agent[0, side, number] = state.agent[0]
    asked.box[0, side, number] = state.box[0]


def stacked(queries: list[Query]) -> Query:
    """One query a trial."""
    every = [one.tensors() for one in queries]
    return queries[0].map(lambda name, _tensor, _axis: torch.cat([one[name] for one in every]))


class RandomMoves:
    """Rolls with any number of sides."""

    def __init__(self, seed: int) -> None:
        self.random = torch.Generator().manual_seed(seed)

    def roll(self, sides: int) -> int:
        return int(torch.randint(sides, (1,), generator=self.random))

    def moves(self, longest: int) -> list[int]:
        """`longest` moves at most, one at least."""
        return [self.roll(4) for _ in range(1 + self.roll(longest))]


def random_queries(
    world: Gridworld, model: Model, number: int, kind: QueryKind, seed: int = 0, longest: int = 3
) -> Query:
    """Pairs of clips of 1 to `longest` steps (guidance: 1) from random states that are not over."""
    random, limit = RandomMoves(seed), 1 if kind == QueryKind.GUIDANCE else longest
    living = (~model.terminal).nonzero().squeeze(1)
    starts = [model.states.pick(living[[random.roll(len(living))]]) for _ in range(number)]
    asked = [query(world, kind, start, random.moves(limit), random.moves(limit)) for start in starts]
    return stacked([padded(one, longest) for one in asked])


def padded(asked: Query, length: int) -> Query:
    """The same query with room for clips of `length` steps."""
    room = max(3, length)
    wide = empty(1, room, asked.board.shape[-2], asked.board.shape[-1]).tensors()

    def fill(name: str, tensor: Tensor, _axis: int | None) -> Tensor:
        if tensor.dim() < 3:
            return tensor
        wide[name][:, :, : tensor.shape[2]] = tensor
        return wide[name]

    return asked.map(fill)


def said(choice: Tensor) -> list[Choice]:
    """The answers by name."""
    return [Choice(one) for one in choice.tolist()]

"""Whole episodes in random mazes, walked through tables: the world of pre-training (Sec. 3.1.4).

The policy does not change within a step of pre-training. So its chances are worked out once for each state of
the mazes drawn, and the episodes are then looked up, not simulated.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import torch
from jaxtyping import Bool, Float64, Int64, UInt8
from torch import Tensor

from parenting.envs.levels.rules import MOVES
from parenting.envs.levels.spec import AGENT, GOAL, maze_legend
from parenting.envs.random_mazes import Mazes, mazes
from parenting.envs.rng import Keys, Stream, keys

EPISODES = 16
"""Whole episodes in a step of pre-training."""
LIMIT = 100
"""Steps after which an episode is cut off (ours)."""
POOL, POOL_SEED = 4096, 2019
"""The mazes to learn from are a fixed pool (ours): the same for every run in a world of this size."""
OUTSIDE, OUTSIDE_SEED = 500, 1902
"""Mazes outside the pool, to see what was learnt."""
BLOCK = 8
"""Steps whose draws are made at once."""
ARRIVED = -1
"""In `Pool.next_state`: this action reaches the goal."""


class Pool(NamedTuple):
    """M mazes as tables. The states of a maze are its free cells but the goal; S is the most that any has."""

    board: UInt8[Tensor, "M H W"]  # without the agent
    cell: Int64[Tensor, "M S"]  # where the agent stands, cells counted row by row
    local_state: UInt8[Tensor, "M S 4"]  # l(s)
    next_state: Int64[Tensor, "M S 4"]  # the state that each action leads to, or ARRIVED
    first: Int64[Tensor, "M"]  # the state at the start
    size: Int64[Tensor, "M"]  # how many states there are
    agent: int  # the agent's code

    def observation(
        self, maze: Int64[Tensor, "*some"], state: Int64[Tensor, "*some"]
    ) -> UInt8[Tensor, "*some H W"]:
        """The agent's observations in states of mazes."""
        board = self.board[maze].flatten(-2)
        drawn = board.scatter(-1, self.cell[maze, state].unsqueeze(-1), self.agent)
        return drawn.view(*maze.shape, *self.board.shape[1:])


@cache
def pool(height: int, width: int, glyphs: str, device: str = "cpu") -> Pool:
    """The mazes to learn from."""
    return tables(mazes(height, width, glyphs, keys(POOL_SEED, POOL, device)), glyphs)


@cache
def outside(height: int, width: int, glyphs: str, device: str = "cpu") -> Pool:
    """Mazes that are not in the pool. Where a size has too few others, fewer; where it has none, the pool."""
    known = mazes(height, width, glyphs, keys(POOL_SEED, POOL, device))
    drawn = mazes(height, width, glyphs, keys(OUTSIDE_SEED, 4 * OUTSIDE, device))
    words = set(map(bytes, _words(known).tolist()))
    fresh = [i for i, word in enumerate(_words(drawn).tolist()) if bytes(word) not in words][:OUTSIDE]
    if not fresh:
        return pool(height, width, glyphs, device)
    return tables(drawn.pick(torch.tensor(fresh, device=device)), glyphs)


def _words(some: Mazes) -> UInt8[Tensor, "M bytes"]:
    return torch.cat((some.board.flatten(1).long(), some.start[:, None] // 256, some.start[:, None] % 256), 1)


def tables(drawn: Mazes, glyphs: str) -> Pool:
    """Mazes as tables, in the codes of a world's glyphs."""
    flat, width = drawn.board.flatten(1), drawn.board.shape[2]
    goal = flat == maze_legend(glyphs).index(GOAL)
    states = (flat != 0) & ~goal
    count = states.sum(1)
    most = int(count.max())
    cell = states.long().argsort(dim=1, descending=True, stable=True)[:, :most]
    number = (states.long().cumsum(1) - 1).masked_fill(goal, ARRIVED)
    ahead = _ahead(flat, cell, width)
    local_state = _here(flat, ahead)
    return Pool(
        board=drawn.board,
        cell=cell,
        local_state=local_state,
        next_state=_here(number, torch.where(local_state == 0, cell[:, :, None], ahead)),  # walls stop it
        first=number.gather(1, drawn.start[:, None]).squeeze(1),
        size=count,
        agent=glyphs.index(AGENT),
    )


def _ahead(flat: UInt8[Tensor, "M HW"], cell: Int64[Tensor, "M S"], width: int) -> Int64[Tensor, "M S 4"]:
    """The cell that lies ahead of each action. There is one: a maze has a wall around it."""
    steps = torch.tensor([row * width + column for row, column in MOVES], device=cell.device)
    return (cell[:, :, None] + steps).clamp(0, flat.shape[1] - 1)  # the rows beyond a maze's states hold any


def _here(flat: Tensor, cell: Int64[Tensor, "M S 4"]) -> Tensor:
    """The codes on cells of boards."""
    return flat[:, None].expand(-1, cell.shape[1], -1).gather(2, cell)


class Batch(NamedTuple):
    """The states of the mazes that each trial has drawn, one after the other. The last row is the goal."""

    observation: UInt8[Tensor, "N R H W"]
    local_state: UInt8[Tensor, "N R 4"]
    next_state: Int64[Tensor, "N R1 4"]
    first: Int64[Tensor, "N E"]


def draw_mazes(pool: Pool, keys: Keys) -> Batch:
    """Draw EPISODES mazes for each trial by its keys, and lay their states one after the other.

    E is EPISODES, R the number of states in the mazes of the trial that has most. Row r of a trial is state
    r - offset of the episode in whose span it lies; row R is the goal of all episodes.
    """
    u = keys.at(Stream.MAZES, torch.arange(EPISODES, device=keys.seed.device))  # [N, E]
    maze = (u * len(pool.size)).long()  # [N, E]
    end = pool.size[maze].cumsum(1)  # [N, E]: one past each episode's last row
    offset = end - pool.size[maze]  # [N, E]: its first row
    rows = int(end[:, -1].max())  # R
    place = torch.arange(rows, device=maze.device).expand(len(maze), -1).contiguous()  # [N, R]
    episode = torch.searchsorted(end, place, right=True).clamp_max(EPISODES - 1)  # [N, R]: whose row it is
    shift, which = offset.gather(1, episode), maze.gather(1, episode)  # [N, R], [N, R]
    state = (place - shift).clamp_max(pool.cell.shape[1] - 1)  # [N, R]; rows beyond a trial's last hold any
    next_state = pool.next_state[which, state]  # [N, R, 4]: states of the maze, or ARRIVED
    next_state = torch.where(next_state == ARRIVED, rows, next_state + shift[:, :, None])  # rows of the batch
    goal = next_state.new_full((len(maze), 1, 4), rows)  # [N, 1, 4]: who is there stays
    return Batch(
        observation=pool.observation(which, state),
        local_state=pool.local_state[which, state],
        next_state=torch.cat((next_state, goal), 1),
        first=pool.first[maze] + offset,
    )


class Walks(NamedTuple):
    """Episodes: the rows of a batch that they came by, and what they did there."""

    state: Int64[Tensor, "N T E"]
    action: Int64[Tensor, "N T E"]
    alive: Bool[Tensor, "N T E"]  # not yet at the goal
    arrived: Bool[Tensor, "N E"]


def walk(batch: Batch, chance: Float64[Tensor, "N R 4"], keys: Keys, limit: int = LIMIT) -> Walks:
    """Walk every episode to its end, or for `limit` steps; `chance` is pi(a|s) in each row."""
    goal = chance.shape[1]  # R
    below = torch.nn.functional.pad(chance.cumsum(2)[:, :, :3], (0, 0, 0, 1))  # [N, R + 1, 3]
    next_state, at = batch.next_state.flatten(1), batch.first  # [N, 4 (R + 1)], [N, E]
    states, actions = [], []
    for t in range(limit):
        if t % BLOCK == 0:
            if bool((at == goal).all()):
                break
            u = _draws(keys, t)
        limits = below.gather(1, at[:, :, None].expand(-1, -1, 3))  # [N, E, 3]
        action = (u[:, t % BLOCK, :, None] >= limits).sum(2)  # [N, E]
        states.append(at)
        actions.append(action)
        at = next_state.gather(1, 4 * at + action)
    state = torch.stack(states, 1)
    return Walks(state, torch.stack(actions, 1), state != goal, at == goal)


def _draws(keys: Keys, t: int) -> Float64[Tensor, "N BLOCK E"]:
    place = torch.arange(BLOCK * EPISODES, device=keys.seed.device)
    return keys.at(Stream.WALKS, EPISODES * t + place).view(-1, BLOCK, EPISODES)

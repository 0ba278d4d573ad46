"""Batched runs under a parent, in the reference's format, so that the two can be compared."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.policy import Network
from parenting.agent.query import Choice, Query, QueryKind, empty
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.parents.scripted import ScriptedParent
from reference.clips import Clip, Frame, board

Judge = Callable[[Query], torch.Tensor]
LogEntry = tuple[int, str, Clip, Clip]


class Judged(NamedTuple):
    """A function of the query as a parent's rule."""

    answer: Judge


def run_batch(
    world: Gridworld,
    config: Config,
    judge: Judge,
    seed: int,
    trials: int,
    ticks: int,
    weights: torch.Tensor | None = None,
) -> tuple[AgentState, list[list[LogEntry]]]:
    """`trials` lives of `ticks` ticks; the state they end in, and what each asked."""
    state = parenting.init(world, config, keys(seed, trials), weights)
    parent = ScriptedParent(Judged(judge), parenting.no_query(world, config, state))
    logs: list[list[LogEntry]] = [[] for _ in range(trials)]
    for tick in range(1, ticks + 1):
        state, query, _, _, _ = parenting.tick(world, config, state, parent)
        for trial in (query.kind != QueryKind.NONE).nonzero().squeeze(1).tolist():
            kind = QueryKind(int(query.kind[trial])).name.lower()
            logs[trial].append((tick, kind, clip(query, trial, 0), clip(query, trial, 1)))
    state.check()
    return state, logs


def clip(query: Query, trial: int, side: int) -> Clip:
    """One clip of a query as the reference holds it."""
    length = int(query.length[trial, side])
    frames = tuple(
        Frame(
            board(query.observation[trial, side, None, place]),
            board(query.board[trial, side, None, place]),
            tuple(query.agent[trial, side, place].tolist()),
            tuple(query.box[trial, side, place].tolist()),
        )
        for place in range(length + 1)
    )
    return Clip(int(query.level[trial]), frames, tuple(query.action[trial, side, :length].tolist()))


def as_query(world: Gridworld, stages: int, left: Clip, right: Clip, kind: str) -> Query:
    """A pair of the reference's clips as a query of one trial."""
    query = empty(1, stages, world.height, world.width)
    query.kind[0], query.level[0] = QueryKind[kind.upper()], left.level
    for side, one in enumerate((left, right)):
        length = len(one.actions)
        query.length[0, side] = length
        query.action[0, side, :length] = torch.tensor(one.actions)
        for place, frame in enumerate(one.frames):
            query.observation[0, side, place] = torch.tensor(frame.observation)
            query.board[0, side, place] = torch.tensor(frame.ground)
            query.agent[0, side, place] = torch.tensor(frame.agent)
            query.box[0, side, place] = torch.tensor(frame.box)
    return query


def random_parent(query: Query) -> torch.Tensor:
    """A parent whose answers have no sense but use all four choices: a function of moves and places alone."""
    moves = (query.action * torch.tensor([[[3], [5]]])).sum((1, 2))
    places = (query.agent * torch.tensor([7, 11])).sum((1, 2, 3))
    return torch.where(query.kind == QueryKind.NONE, 0, 1 + (moves + places) % int(Choice.NEITHER))


def unsure_parent(query: Query) -> torch.Tensor:
    """The same, but at a third of all places every pair of moves is skipped."""
    unclear = query.agent[:, 0, 0].sum(1) % 3 == 0
    skips = unclear & (query.kind == QueryKind.GUIDANCE)
    return torch.where(skips, int(Choice.SKIP), random_parent(query))


def lenient_parent(query: Query) -> torch.Tensor:
    """The same, but *neither* only where a first action is up: so no life is ever stuck."""
    choice = random_parent(query)
    upward = (query.action[:, :, 0] == 0).any(1)
    return torch.where((choice == Choice.NEITHER) & ~upward, int(Choice.EITHER), choice)


def layers(network: Network, parameters: torch.Tensor) -> list[torch.Tensor]:
    """One policy's flat row [P] in the reference's form: weights [fan in, out] and biases, by layer."""
    parts: list[torch.Tensor] = []
    for layer in network.layers:
        weight = parameters[layer.start : layer.bias].view(layer.fan_in, layer.fan_out)
        if layer.padding:  # kept as (row, column, channel), drawn as (channel, row, column)
            weight = weight.view(9, -1, layer.fan_out).transpose(0, 1).flatten(0, 1)
        parts += [weight, parameters[layer.bias : layer.end]]
    return parts

"""Agents at tick 0: fresh weights, a first episode, nothing known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from parenting.agent import dataset, familiarity
from parenting.agent.config import Config
from parenting.agent.policy import Network, network_for
from parenting.agent.state import (
    MOST_VOTES,
    AgentState,
    Asked,
    Confirmation,
    Learner,
    Recorder,
    Rehearsal,
    Ring,
    RunningClip,
    TickInfo,
)
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.levels.spec import Level, maze_legend
from parenting.envs.rng import Keys


def init(
    world: Gridworld, config: Config, keys: Keys, weights: Float[Tensor, "P"] | None = None
) -> AgentState:
    """Make agents at tick 0: fresh weights, a first episode, nothing known.

    Args:
        world: The world that they live in, as `world_of` makes it for this config.
        config: The hyperparameters.
        keys: The random streams of N trials at tick 0, as `envs.rng.keys` makes them; weights are drawn from
            them.
        weights: Weights with which all trials begin instead: those of an earlier policy, or pre-trained ones
            where `config.pretrain` is set.

    Returns:
        The state of N agents.

    Raises:
        ValueError: the config has pre-training on and no weights came, or they are of another size.
    """
    trials, device = len(keys.seed), keys.seed.device

    def zeros(*shape: int, dtype: torch.dtype = torch.int64) -> Tensor:
        return torch.zeros(trials, *shape, dtype=dtype, device=device)

    start = world.reset(keys, zeros())
    return AgentState(
        keys=keys,
        world=start,
        maturity=zeros() + 1,
        answered=zeros(),
        familiarity=zeros(familiarity.n_local_states(len(world.legend))),
        waiting=zeros(dtype=torch.bool),
        refused=zeros(4, dtype=torch.bool),
        set_aside=zeros(6, dtype=torch.bool),
        confirmation=Confirmation(
            votes=zeros(6, MOST_VOTES),
            mirrored=zeros(6, dtype=torch.bool),
            began=zeros(),
            repeats=zeros(),
            dissents=zeros(),
        ),
        x=dataset.empty(trials, world.height, world.width, device),
        recorder=_recorder(world, config.max_clip_length, trials, device),
        learner=_learner(network_of(world), config, keys, weights),
        rehearsal=_rehearsal(network_of(world), config, keys),
        info=no_info(start, getattr(torch, config.dtype)),
    )


def _rehearsal(network: Network, config: Config, keys: Keys) -> Rehearsal:
    trials, size = len(keys.seed), network.size if config.pretrain else 0
    first = torch.zeros(trials, size, dtype=getattr(torch, config.dtype), device=keys.seed.device)
    nothing = torch.zeros_like(keys.tick)
    return Rehearsal(exp_avg=first, exp_avg_sq=torch.zeros_like(first), steps=nothing, owed=nothing.bool())


def _start(network: Network, config: Config, keys: Keys, weights: Tensor | None) -> Float[Tensor, "N P"]:
    dtype = getattr(torch, config.dtype)
    if config.pretrain and weights is None:
        raise ValueError("A run with pretrain = True needs pre-trained weights.")
    if weights is None:
        return network.init_params(keys, dtype)
    if weights.shape != (network.size,):
        raise ValueError(
            f"weights must hold {network.size} numbers for this world, not {tuple(weights.shape)}."
        )
    return weights.to(keys.seed.device, dtype).repeat(len(keys.seed), 1)


def _learner(network: Network, config: Config, keys: Keys, weights: Tensor | None) -> Learner:
    params = _start(network, config, keys, weights)
    return Learner(
        params=params,
        exp_avg=torch.zeros_like(params),
        exp_avg_sq=torch.zeros_like(params),
        steps=torch.zeros_like(keys.tick),
        owed=torch.zeros_like(keys.tick, dtype=torch.bool),
        frozen=params.new_zeros(config.max_clip_length - 1, *params.shape),
    )


def _recorder(world: Gridworld, length: int, trials: int, device: torch.device) -> Recorder:
    def zeros(*shape: int, dtype: torch.dtype = torch.int64) -> Tensor:
        return torch.zeros(trials, *shape, dtype=dtype, device=device)

    byte, flag = torch.int8, torch.bool
    board = (length + 1, world.height, world.width)
    clip = RunningClip(
        board=zeros(*board, dtype=torch.uint8),
        agent=zeros(length + 1, 2, dtype=byte),
        box=zeros(length + 1, 2, dtype=byte),
        action=zeros(length, dtype=byte),
    )
    ring = Ring(
        board=zeros(2, 16, *board, dtype=torch.uint8),
        agent=zeros(2, 16, length + 1, 2, dtype=byte),
        box=zeros(2, 16, length + 1, 2, dtype=byte),
        action=zeros(2, 16, length, dtype=byte),
        length=zeros(2, 16, dtype=byte),
        level=zeros(2, 16),
        tick=zeros(2, 16),
        first=zeros(2, 16),
        digest=zeros(2, 16),
        stored=zeros(2, 16, dtype=flag),
        searchable=zeros(2, 16, dtype=flag),
        count=zeros(2),
    )
    asked = Asked(pair=zeros(16), compared=zeros(16), count=zeros())
    return Recorder(
        running=zeros(dtype=flag), next_kind=zeros(), step=zeros(), clip=clip, ring=ring, asked=asked
    )


def no_info(world: WorldState, dtype: torch.dtype) -> TickInfo:
    """The record of a tick in which nothing has happened yet."""
    nothing, count = torch.zeros_like(world.terminated), torch.zeros_like(world.step_count)
    number = torch.zeros_like(world.step_count, dtype=dtype)
    return TickInfo(
        before=world,
        action=count,
        moved=nothing,
        trained=nothing,
        pausing=nothing,
        familiarity=count,
        logits=number[:, None].expand(-1, 4),
        completed=count[:, None].expand(-1, 2),
        loss=number,
        entropy_global=number,
        entropy_local=number,
    )


def network_of(world: Gridworld) -> Network:
    """The policy's architecture for a world (Sec. 3.1.1); it knows the goal of mazes, too (Sec. 3.1.4)."""
    return network_for(world.height, world.width, len(maze_legend(world.legend)))


def world_of(name: str, level: str | Level | Sequence[Level] | None, config: Config) -> Gridworld:
    """The world that a run with this config lives in.

    Raises:
        UnknownNameError, LevelError, ValueError: as `envs.registry.make`.
    """
    options: dict[str, Any] = {}
    if "supervised" in registry.spec(name, level).options:
        options["supervised"] = config.supervised
    return registry.make(name, level, time_limit=config.max_episode_steps, **options)

"""An episode of a life again: the world alone repeats its moves, with the draws of their ticks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import torch

from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.rng import keys
from parenting.evaluation.episode import Episode as Played
from parenting.server import moves
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.job_kinds import EpisodePayload
from parenting.server.moves import Episode
from parenting.server.runs import get_run
from parenting.server.tables import Run
from parenting.server.work.walk import clip_of, end_of, most_steps


def episode(db: Database, run_id: int, payload: EpisodePayload) -> dict[str, Any]:
    """Return the episode that a tick belongs to as a clip, and how it ended.

    Raises:
        NotFound: no whole episode at this tick is recorded.
    """
    run, lived = get_run(db, run_id), moves.read_moves(db, run_id)
    found = episode_at(lived, payload.tick)
    world = world_of(run.world, run.level_text, Config.model_validate(run.config))
    played, cut = _again(world, run, found, lived)
    return {
        "number": found.number,
        "first": found.first,
        "last": found.last,
        "pauses": found.pauses,
        "steps": found.steps,
        "over": found.end is not None,
        "clip": clip_of(world, played),
        "end": end_of(world, played) if not cut else "time",
        "unsafe": played.unsafe,
    }


def episode_at(lived: bytes, tick: int) -> Episode:
    """Return the episode of a tick.

    Raises:
        NotFound: there is none, or a tick of it is not known.
    """
    for one in moves.episodes(lived):
        if one.first <= tick <= one.last:
            if one.whole:
                return one
            raise NotFound(
                f"The episode of tick {tick} was lived in part before moves were kept, or on another machine."
            )
    raise NotFound(f"No episode of tick {tick} is recorded. Choose a tick from 1 to {len(lived)}.")


class Step(NamedTuple):
    """A step of an episode, made again."""

    tick: int
    action: int
    unsafe: bool
    after: WorldState


def start_of(world: Gridworld, seed: int, found: Episode) -> WorldState:
    """Return the state in which an episode of a life began."""
    begun = keys(seed, 1).replace(tick=torch.tensor([found.first if found.first > 1 else 0]))
    return world.reset(begun, torch.zeros(1, dtype=torch.int64))


def steps(world: Gridworld, seed: int, found: Episode, lived: bytes) -> Iterator[Step]:
    """Make the moves of an episode again; ticks in which the agent waited are left out.

    Args:
        world: The world of the run.
        seed: The run's seed.
        found: The episode, every tick of which is known.
        lived: The moves of the whole life (`server.moves`).
    """
    start, state = keys(seed, 1), start_of(world, seed, found)
    for tick in range(found.first, found.last + 1):
        move = lived[tick - 1]
        if move & moves.WAY == moves.PAUSE:
            continue
        action = move & moves.WAY
        state = world.step(state, torch.tensor([action]), start.replace(tick=torch.tensor([tick])))
        yield Step(tick, action, bool(move & moves.UNSAFE), state)


def _again(world: Gridworld, run: Run, found: Episode, lived: bytes) -> tuple[Played, bool]:
    """Make the moves of an episode again; a long one is cut off, as walks are."""
    states, actions, unsafe = [start_of(world, run.seed, found)], list[int](), list[int]()
    most = most_steps(world)
    for step in steps(world, run.seed, found, lived):
        if len(actions) == most:
            return Played(states, actions, unsafe), True
        states.append(step.after)
        actions.append(step.action)
        if step.unsafe:
            unsafe.append(len(actions))
    return Played(states, actions, unsafe), False

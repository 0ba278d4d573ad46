"""A walk: the present policy plays an episode by itself, and says what it would do in every cell.

It is played in a world of its own with randomness of its own, from a run's last checkpoint. So the agent's
life goes on, or waits, as if nobody watched.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.drawing.clip import Clip, Frame
from parenting.drawing.query_tensors import ACTIONS, glyph_rows
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.rng import keys
from parenting.evaluation.cells import probabilities
from parenting.evaluation.episode import Episode, play
from parenting.server.db import Database
from parenting.server.job_kinds import WalkPayload
from parenting.server.recall import recall
from parenting.server.runs import get_run
from parenting.server.snapshot import Snapshot, initial_weights

WALK_SEED = 2**54
"""Walks draw from seeds from here on, and runs from seeds below 2**53: no draw of a life is used."""
MOST_STEPS = 100
"""A walk is cut off after so many steps: nobody looks at a longer one."""
MOST_GLYPHS = 800_000
"""The frames of a walk hold at most so many glyphs; on very large boards the walk is shorter."""


class Present(NamedTuple):
    """The present policy of a run, as its last checkpoint has it."""

    world: Gridworld
    parameters: Float[Tensor, "1 P"]
    facts: dict[str, int]  # tick, stage, and the answers that it has heard
    saved: Snapshot


def present(db: Database, run_id: int) -> Present:
    """Read the present policy of a run; one that has no checkpoint yet is at its beginning.

    Raises:
        NotFound: there is no such run.
        DamagedRowError: its row cannot be read.
    """
    run = get_run(db, run_id)
    config = Config.model_validate(run.config)
    world = world_of(run.world, run.level_text, config)
    saved = recall(db, run, world, config, initial_weights(db, run, world)).saved
    facts = {
        "tick": int(saved.state.keys.tick[0]),
        "maturity": int(saved.state.maturity[0]),
        "answers": int(saved.tally.kinds.sum()),
    }
    return Present(world, saved.state.learner.params, facts, saved)


def walk(db: Database, run_id: int, payload: WalkPayload) -> dict[str, Any]:
    """Return a walk as a clip, and what the policy would do in every cell of the level that it began on."""
    world, parameters, facts, _ = present(db, run_id)
    episode = play(world, parameters, keys(WALK_SEED + payload.seed, 1), most_steps(world))
    return {
        **facts,
        "clip": clip_of(world, episode),
        "end": end_of(world, episode),
        "unsafe": episode.unsafe,
        "cells": _cells(world, parameters, episode.states[0]),
    }


def policy(db: Database, run_id: int, _payload: object) -> dict[str, Any]:
    """Return what the present policy would do in every cell of its level."""
    world, parameters, facts, _ = present(db, run_id)
    start = world.beginnings().pick(torch.tensor([0]))
    return {**facts, "start": _frame(world, start), "cells": _cells(world, parameters, start)}


def _cells(world: Gridworld, parameters: Tensor, start: WorldState) -> list[dict[str, Any]]:
    found = probabilities(world, parameters, start)
    return [{"cell": list(cell), "probabilities": chances} for cell, chances in found.items()]


def most_steps(world: Gridworld) -> int:
    """Return the number of steps after which a walk is cut off."""
    frame = 2 * world.height * world.width
    return min(world.time_limit, MOST_STEPS, max(1, MOST_GLYPHS // frame))


def end_of(world: Gridworld, episode: Episode) -> str:
    """Return how the episode ended: at the goal, by harm, held to its end, or by its length."""
    last = episode.states[-1]
    if bool(last.terminated[0]):
        on_goal = bool(world.lookup("G")[world.tile(last.board, last.agent)][0])
        return "goal" if on_goal else "harm"
    return "held" if bool(world.frozen(last)[0]) else "time"


def clip_of(world: Gridworld, episode: Episode) -> Clip:
    """Return an episode as a clip."""
    actions = [ACTIONS[action] for action in episode.actions]
    return Clip(
        actions=actions, length=len(actions), frames=[_frame(world, state) for state in episode.states]
    )


def _frame(world: Gridworld, state: WorldState) -> Frame:
    box = state.box[0].tolist()
    return Frame(
        ground=glyph_rows(world.legend, state.board[0]),
        observed=glyph_rows(world.legend, world.observe(state.board, state.agent, state.box)[0]),
        agent=state.agent[0].tolist(),
        box=None if box[0] < 0 else box,
    )

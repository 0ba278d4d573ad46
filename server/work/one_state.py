"""The policy in one state, which a page shows and no snapshot has: the agent need never have met it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from parenting.agent.familiarity import ask_chance, local_state_index
from parenting.agent.init import network_of
from parenting.drawing.query_tensors import glyph_rows
from parenting.envs.gridworld import Gridworld, WorldState, local_state
from parenting.envs.levels.spec import PIECES
from parenting.server.board import store
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.job_kinds import StatePayload
from parenting.server.snapshot import Snapshot
from parenting.server.work.walk import present

Rest = tuple[Sequence[str], Sequence[int] | None]
"""The rows of a board, and the box's cell."""


def one_state(db: Database, run_id: int, payload: StatePayload) -> dict[str, Any]:
    """Return pi(a|s) in a state, f of its local state, and p_guid ** f (Sec. 2.1).

    Raises:
        NotFound: the agent cannot stand there, or there is no such rest or stage.
    """
    world, _, facts, saved = present(db, run_id)
    start = world.beginnings().pick(torch.tensor([0]))
    state = _state(world, start, payload, _rest(db, run_id, world, start, payload))
    stage = facts["maturity"] if payload.stage is None else payload.stage
    seen = world.observe(state.board, state.agent, state.box)
    near = local_state(seen, state.agent)
    logits = network_of(world).logits(_parameters(saved, stage), seen, near)
    f = saved.state.familiarity[:, local_state_index(near, len(world.legend))[0]]
    return {
        **facts,
        "stage": stage,
        **payload.model_dump(include={"row", "column", "rest"}),
        "probabilities": [round(chance, 6) for chance in logits[0].double().softmax(-1).tolist()],
        "familiarity": int(f[0]),
        "ask": float(ask_chance(f, saved.config.p_guid)[0]),
    }


def _parameters(saved: Snapshot, stage: int) -> Float[Tensor, "1 P"]:
    newest = int(saved.state.maturity[0])
    if stage > newest:
        raise NotFound(f"There is no policy of stage {stage}; the present one is of stage {newest}.")
    learner = saved.state.learner
    return learner.params if stage == newest else learner.frozen[stage - 1]


def _rest(db: Database, run_id: int, world: Gridworld, start: WorldState, payload: StatePayload) -> Rest:
    """Return board and box: the given ones, or those of a stored rest, or of an episode's beginning."""
    ground, box = glyph_rows(world.legend, start.board[0]), _box_of(start)
    if payload.rest is not None:
        stored = store.read_states(db, run_id)
        rests = stored[0]["rests"] if stored else []
        if payload.rest >= len(rests):
            raise NotFound(f"No board {payload.rest} of this run is stored; there are {len(rests)}.")
        ground, box = rests[payload.rest]["ground"], rests[payload.rest]["box"]
    if payload.ground is not None:
        ground = payload.ground.removesuffix("\n").split("\n")
    if payload.box_row is not None and payload.box_column is not None:
        box = [payload.box_row, payload.box_column]
    return ground, box


def _box_of(start: WorldState) -> list[int] | None:
    row, column = start.box[0].tolist()
    return None if row < 0 else [row, column]


def _state(world: Gridworld, start: WorldState, payload: StatePayload, rest: Rest) -> WorldState:
    ground, box = rest
    known = set(world.legend) - set(PIECES)
    if [len(row) for row in ground] != [world.width] * world.height or not known.issuperset("".join(ground)):
        raise NotFound(f"The board has to be {world.height} rows of {world.width} tiles of this world.")
    agent = [payload.row, payload.column]
    if not _inside(world, agent) or agent == box or _tile(ground, agent) in world.walls + world.ends:
        raise NotFound(f"The agent cannot stand on row {agent[0] + 1}, column {agent[1] + 1}.")
    if box is not None and (
        _box_of(start) is None or not _inside(world, box) or _tile(ground, box) in world.walls
    ):
        raise NotFound(f"No box can lie on row {box[0] + 1}, column {box[1] + 1}.")
    codes = [[world.legend.index(glyph) for glyph in row] for row in ground]
    return start.replace(
        board=torch.tensor([codes], dtype=torch.uint8),
        agent=torch.tensor([agent]),
        box=torch.tensor([[-1, -1] if box is None else list(box)]),
    )


def _inside(world: Gridworld, cell: Sequence[int]) -> bool:
    return cell[0] < world.height and cell[1] < world.width


def _tile(ground: Sequence[str], cell: Sequence[int]) -> str:
    return ground[cell[0]][cell[1]]

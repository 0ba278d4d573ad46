"""Queries between tensors and the database: frames as rows of glyphs, actions by name, readable by eye.

Reading a stored query back gives the same tensors bit for bit. Three fields are not in its clips: `kind`,
`maturity` and `votes` are columns of their own. `level`, the index among the levels of a batch, is not stored
at all: a stored run has one level, so its index is always 0, and `encode` refuses any other.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from parenting.agent import query as queries
from parenting.agent.forecast_chance import forecast_chances
from parenting.agent.query import Choice, Query, QueryKind
from parenting.drawing.query_tensors import ACTIONS, SIDES, read_clips
from parenting.envs.gridworld import Gridworld

KINDS = {"guidance": QueryKind.GUIDANCE, "preference": QueryKind.PREFERENCE}
CHOICES = {choice.name.lower(): choice for choice in Choice if choice != Choice.NONE}
CHOICE_NAMES = {int(choice): name for name, choice in CHOICES.items()}


def encode(world: Gridworld, query: Query) -> dict[str, Any]:
    """Write the clips of a run's one query, as stored in `query.clips` (server.tables).

    Args:
        world: The world of the run, whose legend names the glyphs.
        query: A batch of one query.

    Raises:
        ValueError: the query is of another level than the run's only one.
    """
    if int(query.level[0]) != 0:
        raise ValueError(f"level: {int(query.level[0])} cannot be stored; a stored run has one level, 0.")
    return dict(read_clips(query, world.legend, chances=forecast_chances(world, query)))


def kind_name(query: Query) -> str | None:
    """Return the kind of a run's one query by its name; None where nothing is asked."""
    kind = int(query.kind[0])
    return None if kind == QueryKind.NONE else QueryKind(kind).name.lower()


def decode(
    world: Gridworld, stages: int, kind: str, maturity: int, clips: dict[str, Any], votes: int = 0
) -> Query:
    """Read the query that `encode` wrote.

    Args:
        world: The world of the run.
        stages: The largest number of steps in a clip of this run (its last stage T).
        kind: guidance or preference.
        maturity: The stage that the clips were recorded at.
        clips: What `encode` returned.
        votes: The answers heard before on the same pair of moves in the same pause.

    Raises:
        LookupError, TypeError, ValueError: the clips are not as `encode` writes them.
    """
    query = queries.empty(1, stages, world.height, world.width)
    query.kind[0], query.maturity[0], query.votes[0] = KINDS[kind], maturity, votes
    for side, name in enumerate(SIDES):
        _fill(world, query, side, clips[name])
    return query


def first_state(world: Gridworld, clips: dict[str, Any]) -> tuple[Tensor, Tensor]:
    """Return the observation and the agent's cell in the state in which both clips begin."""
    frame = clips["left"]["frames"][0]
    return _codes(world.legend, frame["observed"])[None], torch.tensor([frame["agent"]])


def _fill(world: Gridworld, query: Query, side: int, clip: dict[str, Any]) -> None:
    query.length[0, side] = clip["length"]
    for place, action in enumerate(clip["actions"]):
        query.action[0, side, place] = ACTIONS.index(action)
    for place, frame in enumerate(clip["frames"]):
        query.board[0, side, place] = _codes(world.legend, frame["ground"])
        query.observation[0, side, place] = _codes(world.legend, frame["observed"])
        query.agent[0, side, place] = torch.tensor(frame["agent"])
        query.box[0, side, place] = torch.tensor(frame["box"] or (-1, -1))


def _codes(legend: str, rows: list[str]) -> Tensor:
    return torch.tensor([[legend.index(glyph) for glyph in row] for row in rows], dtype=torch.uint8)

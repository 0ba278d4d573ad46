"""Routes of the board: the states of a run, its stored snapshots, and the numbers of one."""

from __future__ import annotations

from typing import Annotated

from fastapi import Path, Query
from pydantic import Field

from parenting.drawing.rests import complete
from parenting.server import runs
from parenting.server.admission import admitted_router
from parenting.server.api.lists import Cursor, Number, Part, Place
from parenting.server.api.names import RunId
from parenting.server.api.responses import read_responses
from parenting.server.board import store
from parenting.server.board.columns import known_policies, text_of, unpack
from parenting.server.columns import UNREADABLE
from parenting.server.deps import Db
from parenting.server.errors import DamagedRowError, NotFound
from parenting.server.new_run import LARGEST_INT
from parenting.server.schemas import Schema

router = admitted_router(tags=["runs"])


class RestSchema(Schema):
    """The rest of a state besides the agent's cell."""

    ground: list[str]
    """The rows of the board, without agent and box."""
    box: tuple[int, int] | None
    parts: dict[str, str]
    """The words that differ among the rests of this run, by what they are about."""


class SnapshotSchema(Schema):
    """A stored snapshot."""

    tick: int
    maturity: int
    """The stage T of the policy that acted."""
    answers: int
    """The answers that the agent had heard."""


class BoardSchema(Schema):
    """The states of a run and its snapshots, or those that the reader does not have yet."""

    states: int
    """All states that are stored by now."""
    complete: bool
    """They are all that can be reached; else those that were met."""
    rests: list[RestSchema]
    cells: list[tuple[int, int, int]]
    """For each state the agent's row and column, and the number of its rest, from 0."""
    snapshots: list[SnapshotSchema]


class BoardPart(Part):
    """The part that the reader has already."""

    after: Place = Field(-1, description="Only snapshots after this tick.")
    states: Number = Field(0, description="The number of states that you have.")
    rests: Number = Field(0, description="The number of rests that you have.")


class SnapshotPart(Part):
    """The policy of a snapshot that is wanted."""

    stage: Cursor | None = Field(None, description="An earlier stage's policy.")


class NumbersSchema(SnapshotSchema):
    """The numbers of a snapshot: columns of little-endian integers in base64, a row for each state."""

    states: int
    p_guid: float
    stage: int
    """The stage of the policy: `maturity`, or an earlier one."""
    partial: bool
    """The policy that acted is computed still; read the same tick again later."""
    known: int
    """The states whose policy is here."""
    policy: str
    """Four bytes a state, up, down, left and right: the probability in 255ths; four zeros: not stored."""
    familiarity: str
    """f of the local state, the guidance queries made in it: two bytes a state. Ask with `p_guid ** f`."""
    visits: str
    """The moves that began in the state: four bytes, as in `deaths` and `entries`."""
    deaths: str
    """The unsafe moves that began in it."""
    entries: str
    """The answers that entered X about it."""


@router.get("/runs/{run_id}/board", summary="List states and snapshots", responses=read_responses(404))
def get_board(run_id: RunId, db: Db, part: Annotated[BoardPart, Query()]) -> BoardSchema:
    """List what is stored of a run's policy: the states, and the ticks of the snapshots.

    States are only ever added. Send `states`, `rests` and the last tick as `after` to get what is new.
    """
    run = runs.get_run(db, run_id)
    stored = store.read_states(db, run.id)
    states, every = stored or ({"rests": [], "cells": []}, False)
    words = complete([rest["parts"] for rest in states["rests"]])
    rests = [{**rest, "parts": parts} for rest, parts in zip(states["rests"], words, strict=True)]
    return BoardSchema.model_validate(
        {
            "states": len(states["cells"]),
            "complete": every,
            "rests": rests[part.rests :],
            "cells": states["cells"][part.states :],
            "snapshots": [
                {"tick": row.tick, "maturity": row.stage, "answers": row.answers}
                for row in (store.list_snapshots(db, run.id, part.after) if stored else ())
            ],
        }
    )


@router.get("/runs/{run_id}/board/{tick}", summary="Read a snapshot", responses=read_responses(404))
def get_snapshot(
    run_id: RunId,
    tick: Annotated[int, Path(ge=0, le=LARGEST_INT, description="Its tick, or a later one.", examples=[41])],
    db: Db,
    part: Annotated[SnapshotPart, Query()],
) -> NumbersSchema:
    """Read the last snapshot up to a tick, with the policy that acted or that of an earlier stage."""
    run = runs.get_run(db, run_id)
    row = store.read_snapshot(db, run.id, tick)
    if row is None:
        raise NotFound(
            f"No snapshot of run {run.id} is stored up to tick {tick}. "
            "A worker stores the first one when it takes the run up."
        )
    wanted = row.stage if part.stage is None else part.stage
    other = row if wanted == row.stage else store.read_frozen(db, run.id, wanted)
    if other is None or wanted > row.stage:
        raise NotFound(f"At tick {row.tick} there was no policy of stage {wanted}; the last was {row.stage}.")
    try:
        columns = unpack(row.blob, row.states)
        now = known_policies(columns["policy"])
        policy = unpack(other.blob, other.states)["policy"][: 4 * row.states].ljust(4 * row.states, b"\0")
        return NumbersSchema(
            tick=row.tick,
            maturity=row.stage,
            answers=row.answers,
            states=row.states,
            p_guid=row.p_guid,
            stage=wanted,
            partial=now < row.states,
            known=known_policies(policy),
            **{name: text_of(column) for name, column in {**columns, "policy": policy}.items()},
        )
    except UNREADABLE as error:
        raise DamagedRowError(f"The snapshot of tick {row.tick} is damaged: {error}.") from error

"""Notes in a run's log, of its failures, checkpoints and machines. The agent hears none of them.

They stand in the table `event` beside the operator's events (agent.events), each at its tick, so that the log
of a run is one list. They never belong to the record that a replay repeats.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter
from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.agent.events import Event
from parenting.server.columns import UNREADABLE
from parenting.server.db import Database
from parenting.server.errors import DamagedRowError
from parenting.server.tables import OperatorEvent

AGENT_KINDS = ("mature", "end_episode", "change")
"""The kinds of events that the agent hears (agent.events)."""


class Failed(BaseModel):
    """The worker could not go on; `reason` says why. The tick is the last one reported."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    kind: Literal["failed"] = "failed"
    reason: str


class Resumed(BaseModel):
    """The operator resumed a stopped or failed run: it goes on from its last good checkpoint."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    kind: Literal["resumed"] = "resumed"


class CheckpointDamaged(BaseModel):
    """A checkpoint that cannot be used was passed over; the tick is the checkpoint's."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    kind: Literal["checkpoint_damaged"] = "checkpoint_damaged"
    sha256: str
    reason: str


class MachineChanged(BaseModel):
    """Another machine, or another build of torch, goes on with the run from this tick: bits differ from here.

    Up to tick `until` the run follows its record, since the machine before asked the questions there.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    kind: Literal["machine_changed"] = "machine_changed"
    before: dict[str, Any]
    after: dict[str, Any]
    until: int


class PersonErased(BaseModel):
    """A person's data were deleted: their answers left X after this tick. Weights had learnt from them."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    kind: Literal["person_erased"] = "person_erased"
    answers: int


Note = Failed | Resumed | CheckpointDamaged | MachineChanged | PersonErased
Logged = Annotated[Event | Note, Field(discriminator="kind")]
"""An entry of a run's log: an event that the agent hears, or a note."""
LOGGED: TypeAdapter[Any] = TypeAdapter(Logged)


def read(row: OperatorEvent) -> Any:
    """Return a stored entry of the log.

    Raises:
        ValidationError: it is none.
    """
    return LOGGED.validate_python({"kind": row.kind, **row.payload})


def add_note(session: Session, db: Database, run_id: int, tick: int, note: Note) -> None:
    """Write a note at a tick, in a transaction that is already open."""
    payload = note.model_dump(mode="json", exclude={"kind"})
    row = OperatorEvent(run_id=run_id, kind=note.kind, payload=payload, created=db.clock())
    row.applied_tick = tick
    session.add(row)


def notes(db: Database, run_id: int) -> Sequence[tuple[int, Note]]:
    """Return the notes of a run with their ticks, in their order; unreadable ones are left out."""
    rows = select(OperatorEvent).where(OperatorEvent.run_id == run_id)
    with db.read() as session:
        found = session.scalars(rows.where(OperatorEvent.kind.not_in(AGENT_KINDS)).order_by(OperatorEvent.id))
        return [note for note in map(_read, found) if note is not None]


def _read(row: OperatorEvent) -> tuple[int, Note] | None:
    try:
        return int(row.applied_tick or 0), read(row)
    except (DamagedRowError, *UNREADABLE):
        return None

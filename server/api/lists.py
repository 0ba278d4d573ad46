"""Lists in the API: pages of rows with the cursor of the next page, and the parameters that select one."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Generic, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator

from parenting.server import exports, tables
from parenting.server.damage import damage
from parenting.server.keeping import Tag
from parenting.server.new_run import LARGEST_INT, Name
from parenting.server.notes import Logged
from parenting.server.patterns import METRICS
from parenting.server.reads.curves import FEWEST, POINTS, Axis
from parenting.server.reads.listing import Order
from parenting.server.schemas import (
    AskedSchema,
    DamagedMetricSchema,
    DamagedSchema,
    MetricSchema,
    RunSchema,
    Schema,
)
from parenting.server.statuses import QueryStatus
from parenting.server.strict import DIGITS

Row = TypeVar("Row")
Place = Annotated[int, Field(ge=-1, le=LARGEST_INT), DIGITS]
"""A tick, or an id; -1 lies before the first."""
Number = Annotated[int, Field(ge=0, le=LARGEST_INT), DIGITS]
Cursor = Annotated[int, Field(ge=1, le=LARGEST_INT), DIGITS]
Limit = Annotated[int, DIGITS]


class Rows(Schema, Generic[Row]):
    """One page of a list."""

    rows: list[Row]
    next: int | None
    """The cursor of the next page; null: these are the last rows for now."""


class RunRows(Rows[RunSchema | DamagedSchema]):
    """Runs, newest first."""

    database: str
    """The UUID of the database whose runs these are."""


class AskedRows(Rows[AskedSchema | DamagedSchema]):
    """Questions, oldest first."""


class MetricRows(Rows[MetricSchema | DamagedMetricSchema]):
    """Metrics, in the order of the ticks."""


class OperatorEventSchema(Schema):
    """An operator event, and the tick at which it took effect; or a note on what happened to the run."""

    id: int
    run: int
    event: Logged
    created: datetime
    applied_tick: int | None
    """The tick before which it applied; null: not yet."""


class OperatorEventRows(Rows[OperatorEventSchema | DamagedSchema]):
    """Operator events, in their order."""


class Part(BaseModel):
    """The requested part of a list. A misspelt parameter is refused, because an ignored cursor loses rows."""

    model_config = ConfigDict(extra="forbid")


class RunPart(Part):
    """The requested part of the runs."""

    before: Cursor | None = Field(
        None, description="Only runs behind this one: with smaller ids. The `next` of the page before."
    )
    limit: Limit = Field(50, ge=1, le=200, description="At most this many rows.")
    q: str = Field("", max_length=200, description="Only runs with each of these words, or of this number.")
    tag: Tag | None = Field(None, description="Only runs with this tag.")
    world: Name | None = Field(None, description="Only runs in this world.")
    archived: bool | None = Field(None, description="Only archived ones, or only others.")
    sort: Order = Field(Order.NEWEST, description="Their order; with another one `before` goes by it.")


class AskedPart(Part):
    """The requested part of a run's questions."""

    after: Place = Field(
        -1, description="Only questions asked after this tick; the `next` of the page before."
    )
    limit: Limit = Field(50, ge=1, le=200, description="At most this many rows.")
    status: QueryStatus | None = Field(None, description="Only questions of this status.")


class MetricPart(Part):
    """The requested part of a run's metrics."""

    after: Place = Field(-1, description="Only ticks after this one; the `next` of the page before.")
    limit: Limit = Field(10_000, ge=1, le=10_000, description="At most this many rows.")


OnAxis = Annotated[float, Field(ge=0, le=LARGEST_INT)]
"""A place on the axis of a curve."""


class CurvePart(Part):
    """The requested part of a run's curves."""

    names: str = Field(
        pattern=METRICS, description="Names of metrics, separated by commas.", examples=["deaths,return"]
    )
    by: Axis = Field("tick", description="The axis: ticks, questions answered so far, or minutes.")
    begin: OnAxis | None = Field(None, description="The first place on the axis.")
    end: OnAxis | None = Field(None, description="The last place on the axis.")
    points: Limit = Field(POINTS, ge=FEWEST, le=POINTS, description="At most this many points a curve.")


class ExportPart(Part):
    """The part of a run that is exported, and the format."""

    format: Literal["jsonl", "csv", "zip"] = Field(
        "jsonl", description="jsonl or csv: the table that `of` names; zip: the whole run."
    )
    of: exports.Part = Field(
        exports.Part.ANSWERS, description="answers, metrics or events (the log); not with zip."
    )

    @field_validator("of")
    @classmethod
    def _of_a_table(cls, of: exports.Part, given: ValidationInfo) -> exports.Part:
        if given.data.get("format") == "zip":
            raise ValueError("A zip holds the whole run. Leave this out, or ask for the format jsonl or csv.")
        return of


class FollowPart(Part):
    """The rows of metrics that a live stream sends, too."""

    after: Place | None = Field(None, description="Send metrics too: those of the ticks after this one.")


class EventPart(Part):
    """The requested part of a run's operator events."""

    after: Place = Field(-1, description="Only events with greater ids; the `next` of the page before.")
    limit: Limit = Field(200, ge=1, le=1000, description="At most this many rows.")


def operator_event(row: tables.OperatorEvent) -> OperatorEventSchema | DamagedSchema:
    """Return the schema of a stored event, damaged or not."""
    found = damage(row)
    if found is not None:
        return DamagedSchema(id=row.id, damaged=found)
    event = {"kind": row.kind, **row.payload}
    return OperatorEventSchema.model_validate(
        {
            "id": row.id,
            "run": row.run_id,
            "event": event,
            "created": row.created,
            "applied_tick": row.applied_tick,
        }
    )

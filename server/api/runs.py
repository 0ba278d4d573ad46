"""Routes of runs: list them, start one, read one, its metrics and its operator events."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import Query, Request

from parenting.server.admission import admitted_router
from parenting.server.api.bodies import NewRunBody
from parenting.server.api.lists import (
    CurvePart,
    EventPart,
    MetricPart,
    MetricRows,
    OperatorEventRows,
    RunPart,
    RunRows,
    operator_event,
)
from parenting.server.api.names import RunId
from parenting.server.api.responses import read_responses, write_responses
from parenting.server.curve_schemas import CurveSchema, CurvesSchema
from parenting.server.deps import Db, SettingsOf, start_within_limits
from parenting.server.identity import database_id
from parenting.server.inherited import chosen_origin
from parenting.server.new_run import start
from parenting.server.reads import pagination
from parenting.server.reads.curves import read_curves
from parenting.server.reads.listing import Wanted, find_runs
from parenting.server.reads.schemas import metric_schemas, run_schema, run_schemas
from parenting.server.schemas import RunSchema

router = admitted_router(tags=["runs"])


@router.get("/runs", summary="List the runs", responses=read_responses())
def list_runs(db: Db, part: Annotated[RunPart, Query()]) -> RunRows:
    """List the runs, newest first. Send the `next` of a page as `before` to get the following page.

    Runs are searched by words, tag and world; archived ones are listed unless they are left out.
    """
    wanted = Wanted(part.q, part.tag, part.world, part.archived, part.sort)
    page = find_runs(db, wanted, part.before, part.limit)
    return RunRows(rows=run_schemas(db, page.rows), next=page.next, database=database_id(db))


@router.post("/runs", summary="Start a run", status_code=201, responses=write_responses(409))
def start_run(request: Request, new: NewRunBody, db: Db, settings: SettingsOf) -> RunSchema:
    """Start a run: a new agent in a world, which a worker raises at once.

    Settings that are left out come from the world, or else from the preset. Where as many runs live as may,
    in all or of this client, it is refused (409, `too_many_runs`).
    """
    origin = chosen_origin(db, new.from_policy, new.from_answers)
    begin = partial(start, db, new, settings.weights, origin, settings.bound, settings.runs)
    return run_schema(db, start_within_limits(request, begin).id)


@router.get("/runs/{run_id}", summary="Look at a run", responses=read_responses(404))
def get_run(run_id: RunId, db: Db) -> RunSchema:
    """Read one run: its progress, and who waits for whom."""
    return run_schema(db, run_id)


@router.get("/runs/{run_id}/metrics", summary="Read what was measured", responses=read_responses(404))
def list_metrics(run_id: RunId, db: Db, part: Annotated[MetricPart, Query()]) -> MetricRows:
    """List metrics by tick: deaths, answers by kind and choice, loss, entropy, return, and more.

    Send the `next` of a page as `after` to get the following page. To wait for new rows, send the last tick
    that you have.
    """
    page = pagination.metrics_after(db, run_id, part.after, part.limit)
    return MetricRows(rows=metric_schemas(page.rows), next=page.next)


@router.get("/runs/{run_id}/curves", summary="Read curves to draw", responses=read_responses(404))
def list_curves(run_id: RunId, db: Db, part: Annotated[CurvePart, Query()]) -> CurvesSchema:
    """Read what was measured as curves, each with at most 2,000 points, however long the run has lived.

    Extremes are kept. For all points of a part of the axis, ask for that part.
    """
    wanted = list(dict.fromkeys(part.names.split(",")))
    found = read_curves(db, run_id, wanted, part.by, part.begin, part.end, part.points)
    curves = [CurveSchema(name=name, x=x, y=y) for name, (x, y) in found.curves.items()]
    return CurvesSchema(by=part.by, rows=found.rows, last=found.last, thinned=found.thinned, curves=curves)


@router.get(
    "/runs/{run_id}/operator-events", summary="List the operator's events", responses=read_responses(404)
)
def list_operator_events(run_id: RunId, db: Db, part: Annotated[EventPart, Query()]) -> OperatorEventRows:
    """List the operator events of a run, each with the tick before which it applied.

    Together with seed, config and answers they determine the run: replayed at these ticks, it has the same
    bits. Send the `next` of a page as `after` to get the following page.
    """
    page = pagination.operator_events_after(db, run_id, part.after, part.limit)
    return OperatorEventRows(rows=[operator_event(row) for row in page.rows], next=page.next)

"""Routes that look at runs and start them."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request

from parenting.server.api.bodies import RunId
from parenting.server.api.lists import (
    EventPart,
    MetricPart,
    MetricRows,
    OperatorEventRows,
    RunPart,
    RunRows,
    operator_event,
)
from parenting.server.api.responses import read_responses, write_responses
from parenting.server.deps import Db, SettingsOf, notify_worker
from parenting.server.new_run import NewRun, start
from parenting.server.reads import pagination
from parenting.server.schemas import RunSchema, metric_schemas, run_schema, run_schemas

router = APIRouter(tags=["runs"])


@router.get("/runs", summary="List the runs", responses=read_responses())
def list_runs(db: Db, part: Annotated[RunPart, Query()]) -> RunRows:
    """All runs, newest first. The `next` of a page goes back as `before`."""
    page = pagination.runs_before(db, part.before, part.limit)
    return RunRows(rows=run_schemas(db, page.rows), next=page.next)


@router.post("/runs", summary="Start a run", status_code=201, responses=write_responses())
def start_run(request: Request, new: NewRun, db: Db, settings: SettingsOf) -> RunSchema:
    """A new agent in a world, which a worker raises at once.

    What is left out is as the world, or else the preset, has it.
    """
    run = start(db, new, settings.weights)
    notify_worker(request)
    return run_schema(db, run.id)


@router.get("/runs/{run_id}", summary="Look at a run", responses=read_responses(404))
def get_run(run_id: RunId, db: Db) -> RunSchema:
    """One run as it is now: whom it waits for, how far it is."""
    return run_schema(db, run_id)


@router.get("/runs/{run_id}/metrics", summary="Read what was measured", responses=read_responses(404))
def list_metrics(run_id: RunId, db: Db, part: Annotated[MetricPart, Query()]) -> MetricRows:
    """What the worker measured, by tick: deaths, answers by kind and choice, loss, entropy, return, and more.

    The `next` of a page goes back as `after`. Whoever waits for more takes the last tick that was seen.
    """
    page = pagination.metrics_after(db, run_id, part.after, part.limit)
    return MetricRows(rows=metric_schemas(page.rows), next=page.next)


@router.get(
    "/runs/{run_id}/operator-events", summary="List the operator's events", responses=read_responses(404)
)
def list_operator_events(run_id: RunId, db: Db, part: Annotated[EventPart, Query()]) -> OperatorEventRows:
    """What the operator did to the agent, each with the tick before which it applied.

    With seed, config and answers they make the run: replayed at these ticks, it comes out with the same bits.
    The `next` of a page goes back as `after`.
    """
    page = pagination.operator_events_after(db, run_id, part.after, part.limit)
    return OperatorEventRows(rows=[operator_event(row) for row in page.rows], next=page.next)

"""Routes on runs: list, start, look, pause, resume, stop, mature, end the episode."""

from __future__ import annotations

from fastapi import APIRouter, Request

from agent.events import EndEpisode, Mature
from server.api.words import After, RunId, errors
from server.deps import Db, SettingsOf, ring
from server.record import add_event, metrics
from server.runs import set_status
from server.shapes import MetricsShape, RunShape, shape_metrics, shape_run, shape_runs
from server.starting import NewRun, start

router = APIRouter(tags=["runs"])
PAGE = 10_000


@router.get("/runs", responses=errors())
def runs(db: Db) -> list[RunShape]:
    """All runs, newest first (at most 200)."""
    return shape_runs(db)


@router.post("/runs", status_code=201, responses=errors(403, 413))
def create(request: Request, new: NewRun, db: Db, settings: SettingsOf) -> RunShape:
    """Start a run."""
    run = start(db, new, settings.weights)
    ring(request)
    return shape_run(db, run.id)


@router.get("/runs/{run_id}", responses=errors(404))
def run(run_id: RunId, db: Db) -> RunShape:
    """One run as it is now."""
    return shape_run(db, run_id)


@router.get("/runs/{run_id}/metrics", responses=errors(404))
def measured(run_id: RunId, db: Db, after: After = -1) -> MetricsShape:
    """What was measured after a tick, at most 10,000 rows at once."""
    rows = metrics(db, run_id, after, PAGE)
    return MetricsShape(rows=shape_metrics(rows), more=len(rows) == PAGE)


@router.post("/runs/{run_id}/pause", responses=errors(403, 404, 409))
def pause(request: Request, run_id: RunId, db: Db) -> RunShape:
    """Let no tick pass until the run is resumed."""
    return _become(request, db, run_id, "paused")


@router.post("/runs/{run_id}/resume", responses=errors(403, 404, 409))
def resume(request: Request, run_id: RunId, db: Db) -> RunShape:
    """Let a paused run go on."""
    return _become(request, db, run_id, "active")


@router.post("/runs/{run_id}/stop", responses=errors(403, 404, 409))
def stop(request: Request, run_id: RunId, db: Db) -> RunShape:
    """End a run for good; its open questions are withdrawn."""
    return _become(request, db, run_id, "stopped", "Stopped by the operator.")


@router.post("/runs/{run_id}/mature", status_code=202, responses=errors(403, 404, 409))
def mature(request: Request, run_id: RunId, db: Db) -> RunShape:
    """End this stage of maturation before the next tick (Sec. 2.4)."""
    return _happen(request, db, run_id, Mature())


@router.post("/runs/{run_id}/end-episode", status_code=202, responses=errors(403, 404, 409))
def end_episode(request: Request, run_id: RunId, db: Db) -> RunShape:
    """End this episode before the next tick: the way out when no action is acceptable."""
    return _happen(request, db, run_id, EndEpisode())


def _become(request: Request, db: Db, run_id: int, status: str, reason: str | None = None) -> RunShape:
    set_status(db, run_id, status, reason)
    ring(request)
    return shape_run(db, run_id)


def _happen(request: Request, db: Db, run_id: int, event: Mature | EndEpisode) -> RunShape:
    add_event(db, run_id, event.kind, event.model_dump(mode="json"))
    ring(request)
    return shape_run(db, run_id)

"""Routes of the operator: pause, resume, stop, goal, pace, and operator events."""

from __future__ import annotations

from functools import partial

from fastapi import Request

from parenting.agent.events import Change, EndEpisode, Event, Mature
from parenting.server import runs
from parenting.server.admission import admitted_router
from parenting.server.api.bodies import ChangeBody, GoalBody, PaceBody, RollBackBody
from parenting.server.api.names import RunId
from parenting.server.api.responses import write_responses
from parenting.server.deps import Db, SettingsOf, notify_worker, start_within_limits
from parenting.server.operator_events import add_operator_event
from parenting.server.reads.schemas import run_schema
from parenting.server.rollback import roll_back
from parenting.server.schemas import RunSchema
from parenting.server.statuses import RunStatus

router = admitted_router(tags=["operator"])

REPLIES = write_responses(404, 409)


@router.post("/runs/{run_id}/pause", summary="Pause a run", responses=REPLIES)
def pause_run(request: Request, run_id: RunId, db: Db) -> RunSchema:
    """Pause a run: no tick passes until it is resumed. A second call changes nothing."""
    return _become(request, db, run_id, RunStatus.PAUSED)


@router.post("/runs/{run_id}/resume", summary="Resume a run", responses=REPLIES)
def resume_run(request: Request, run_id: RunId, db: Db) -> RunSchema:
    """Resume a paused run, or a stopped or failed one from its last good checkpoint.

    Questions that were withdrawn when it ended are asked again. A second call changes nothing.
    """
    return _become(request, db, run_id, RunStatus.ACTIVE)


@router.post("/runs/{run_id}/stop", summary="Stop a run", responses=REPLIES)
def stop_run(request: Request, run_id: RunId, db: Db) -> RunSchema:
    """End a run and withdraw its open questions; it can be resumed. A second call changes nothing."""
    return _become(request, db, run_id, RunStatus.STOPPED, "Stopped by the operator.")


@router.post("/runs/{run_id}/goal", summary="Set a run's goal", responses=REPLIES)
def set_goal(request: Request, run_id: RunId, body: GoalBody, db: Db) -> RunSchema:
    """Let the run rest once this many questions are answered. The agent learns the same, only less long."""
    runs.set_goal(db, run_id, body.goal)
    notify_worker(request)
    return run_schema(db, run_id)


@router.post("/runs/{run_id}/pace", summary="Set a run's pace", responses=REPLIES)
def set_pace(request: Request, run_id: RunId, body: PaceBody, db: Db) -> RunSchema:
    """Limit the ticks in a second, for those who watch. The agent learns the same."""
    runs.set_pace(db, run_id, body.pace)
    notify_worker(request)
    return run_schema(db, run_id)


@router.post("/runs/{run_id}/mature", summary="End the stage", status_code=202, responses=REPLIES)
def mature_run(request: Request, run_id: RunId, db: Db) -> RunSchema:
    """End this stage of maturation before the next tick (Sec. 2.4). The last stage never ends: 409."""
    return _happen(request, db, run_id, Mature())


@router.post("/runs/{run_id}/end-episode", summary="End the episode", status_code=202, responses=REPLIES)
def end_episode(request: Request, run_id: RunId, db: Db) -> RunSchema:
    """End this episode before the next tick, for example when no action is acceptable."""
    return _happen(request, db, run_id, EndEpisode())


@router.post("/runs/{run_id}/change", summary="Change a probability", status_code=202, responses=REPLIES)
def change_run(request: Request, run_id: RunId, body: ChangeBody, db: Db) -> RunSchema:
    """Set `p_guid`, `p_rec`, `p_pref` or `p_train` from the next tick on.

    `config` keeps the value that the run was started with; the change is listed among the operator events.
    """
    return _happen(request, db, run_id, Change(name=body.name, value=body.value))


@router.post(
    "/runs/{run_id}/roll-back",
    summary="Roll a run back",
    status_code=201,
    responses=write_responses(404, 409),
)
def roll_back_run(
    request: Request, run_id: RunId, body: RollBackBody, db: Db, settings: SettingsOf
) -> RunSchema:
    """Start a new run from a tick of this one: its record up to that tick is copied, and this run stays.

    A worker lives the copied ticks again, bit for bit, and goes on from there. Questions whose answers the
    agent had not heard by then are asked again. `origin` of the new run names this one.
    """
    begin = partial(roll_back, db, run_id, body.tick, body.name, settings.runs)
    return run_schema(db, start_within_limits(request, begin).id)


def _become(request: Request, db: Db, run_id: int, status: RunStatus, reason: str | None = None) -> RunSchema:
    runs.set_status(db, run_id, status, reason, request.app.state.settings.runs)
    notify_worker(request)
    return run_schema(db, run_id)


def _happen(request: Request, db: Db, run_id: int, event: Event) -> RunSchema:
    add_operator_event(db, run_id, event.kind, event.model_dump(mode="json"))
    notify_worker(request)
    return run_schema(db, run_id)

"""The operator's verbs, each a plain form: pause, resume, stop, mature, end the episode, set numbers.

A wrong field brings the dashboard back with an error next to the field.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

from fastapi import Form, Query, Request, Response
from pydantic import TypeAdapter, ValidationError

from parenting.agent.events import Change, EndEpisode, Mature, Probability
from parenting.server import operator_events, runs
from parenting.server.admission import admitted_router
from parenting.server.api.names import RunId
from parenting.server.deps import Db, SettingsOf, notify_worker
from parenting.server.new_run import Goal, Pace
from parenting.server.pages.dashboard import dashboard_page
from parenting.server.pages.operator_log import PROBABILITIES, probabilities
from parenting.server.pages.render import moved, page, redirect
from parenting.server.pages.start import FormFields
from parenting.server.pages.texts import parent_title
from parenting.server.queue.queries import open_counts
from parenting.server.statuses import RunStatus

router = admitted_router(include_in_schema=False)

Back = Annotated[Literal["parent", "dashboard", "operator"], Form()]
AskedBack = Annotated[Literal["parent", "dashboard"], Query()]
BACK_PATHS = {"parent": "/parent", "dashboard": "", "operator": "#operator"}
"""The page that a form leads back to, below the run's address."""

FIELD_ERRORS = {
    **dict.fromkeys(PROBABILITIES, "A probability is a number from 0 to 1, such as 0.5."),
    "goal": "A goal is a whole number of answers from 1 to 1000000; leave it empty to have none.",
    "pace": "A pace is a number of ticks a second, above 0 and up to 1000; leave it empty to have none.",
}
"""The error next to a wrong field."""


@router.post("/runs/{run_id}/status")
def set_status(
    request: Request,
    run_id: RunId,
    db: Db,
    settings: SettingsOf,
    status: Annotated[Literal["active", "paused", "stopped"], Form()],
    back: Back = "dashboard",
) -> Response:
    """Pause, resume or stop, then back to where the button was."""
    reason = "Stopped by the operator." if status == "stopped" else None
    runs.set_status(db, run_id, RunStatus(status), reason, settings.runs)
    return _back(request, back)


@router.get("/runs/{run_id}/end")
def end_page(request: Request, run_id: RunId, db: Db, back: AskedBack = "dashboard") -> Response:
    """Ask before a run is ended: the page says what is lost, and that it can be taken back."""
    run = runs.get_run(db, run_id)
    if (there := moved(request, run)) is not None:
        return there
    waits = open_counts(db, run_id)
    count = waits.guidance + waits.preference
    return page("end.html", run=run, title=parent_title(run), open=count, back=back, way=BACK_PATHS[back])


@router.post("/runs/{run_id}/event")
def event(
    request: Request,
    run_id: RunId,
    db: Db,
    kind: Annotated[Literal["mature", "end_episode"], Form()],
    back: Back = "dashboard",
) -> Response:
    """End the stage, or an episode in which no action was acceptable."""
    happens = Mature() if kind == "mature" else EndEpisode()
    operator_events.add_operator_event(db, run_id, kind, happens.model_dump(mode="json"))
    return _back(request, back)


@router.post("/runs/{run_id}/probabilities")
def set_probabilities(request: Request, run_id: RunId, db: Db, form: FormFields) -> Response:
    """Set those of the four probabilities that differ from what they are: an event for each."""
    run = runs.get_run(db, run_id)
    given, wrong = _numbers(form, PROBABILITIES, Probability)
    if wrong:
        return dashboard_page(db, run_id, form, wrong)
    known = probabilities(run, operator_events.list_operator_events(db, run_id))
    for name in [name for name in PROBABILITIES if given[name] != known[name]]:
        change = Change.model_validate({"name": name, "value": given[name]})
        operator_events.add_operator_event(db, run_id, change.kind, change.model_dump(mode="json"))
    return _back(request, "operator")


@router.post("/runs/{run_id}/goal")
def set_goal(request: Request, run_id: RunId, db: Db, form: FormFields, back: Back = "operator") -> Response:
    """Let the agent rest after so many answers, or never."""
    given, wrong = _numbers(form, ["goal"], Goal | None)
    if wrong:
        return dashboard_page(db, run_id, form, wrong)
    runs.set_goal(db, run_id, given["goal"])
    return _back(request, back)


@router.post("/runs/{run_id}/pace")
def set_pace(request: Request, run_id: RunId, db: Db, form: FormFields) -> Response:
    """Let so many ticks pass in a second at most, or as many as can."""
    given, wrong = _numbers(form, ["pace"], Pace | None)
    if wrong:
        return dashboard_page(db, run_id, form, wrong)
    runs.set_pace(db, run_id, given["pace"])
    return _back(request, "operator")


def _numbers(
    form: Mapping[str, str], names: Iterable[str], kind: Any
) -> tuple[dict[str, Any], dict[str, str]]:
    """Numbers from a form's text, None from an empty one; and what is wrong with those that are none."""
    given, wrong, reader = {}, {}, TypeAdapter(kind)
    for name in names:
        try:
            given[name] = reader.validate_python(form.get(name, "").strip() or None)
        except ValidationError:
            wrong[name] = FIELD_ERRORS[name]
    return given, wrong


def _back(request: Request, back: str) -> Response:
    """Wake the worker, and go back to where the button was, by the name that the form has for the run."""
    notify_worker(request)
    return redirect(f"/runs/{request.path_params['run_id']}{BACK_PATHS[back]}")

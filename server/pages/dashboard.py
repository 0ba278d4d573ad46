"""The dashboard of a run: who waits for whom, and how it learns, in charts (JavaScript) and in a table."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Form, Request, Response

from agent.events import EndEpisode
from server import record, runs
from server.api.words import RunId
from server.deps import Db, ring
from server.guard import policy
from server.pages.measures import Measures, began, measures
from server.pages.render import page, see
from server.pages.words import SENTENCES, state, title
from server.shapes import shape_run
from server.views import sampled_metrics

router = APIRouter(include_in_schema=False)

Back = Annotated[Literal["parent", "dashboard"], Form()]

STATUS = {**SENTENCES, "question": ("A question waits for the parent.", "")}
"""Who waits for whom, seen from outside."""

CHARTS = (
    ("deaths", "", "Unsafe moves so far."),
    ("asked", "Questions", "Answered so far, by kind."),
    ("answers", "Answers", "By choice."),
    ("return", "", ""),
    ("loss", "Loss", "Eq. (2) on X."),
    ("entropy", "Entropy", "Of each head of the network, in nats."),
    ("size", "Dataset X", "Distinct rows, and entries."),
)
"""Id, name and one sentence for every chart; web/static/dashboard.js draws them. Two go by the world."""

COLUMNS = ("deaths", "guidance", "preference", "loss", "entropy_global", "entropy_local", "return", "size")
HEADS = {"size": "entries", "entropy_global": "entropy global", "entropy_local": "entropy local"}
"""What a column of the table is called, where that is not its name."""


@router.get("/runs/{run_id}")
def dashboard(run_id: RunId, db: Db) -> Response:
    """The page. Its styles may be inline, since Plotly writes them so; its scripts may not."""
    run = runs.get_run(db, run_id)
    rows = sampled_metrics(db, run_id)
    shape = shape_run(db, run_id)
    names = measures(run.legend)
    now = "paused" if run.status == "paused" else state(shape, offered=True)
    response = page(
        "dashboard.html",
        run=run,
        title=title(run),
        state=now,
        sentences=STATUS,
        began=began(run),
        names=names,
        charts=[(chart, *_named(chart, name, text, names)) for chart, name, text in CHARTS],
        columns=[(column, _head(column, names)) for column in COLUMNS],
        rows=rows,
        last=rows[0].values if rows else {},
    )
    response.headers["Content-Security-Policy"] = policy(inline_styles=True)
    return response


@router.post("/runs/{run_id}/status")
def set_status(
    request: Request,
    run_id: RunId,
    db: Db,
    status: Annotated[Literal["active", "paused", "stopped"], Form()],
    back: Back = "dashboard",
) -> Response:
    """Pause, resume or stop, then back to where the button was."""
    runs.set_status(db, run_id, status, "Stopped by the operator." if status == "stopped" else None)
    ring(request)
    return _back(run_id, back)


@router.post("/runs/{run_id}/event")
def event(
    request: Request,
    run_id: RunId,
    db: Db,
    kind: Annotated[Literal["end_episode"], Form()],
    back: Back = "dashboard",
) -> Response:
    """End an episode in which no action was acceptable, then back to where the button was."""
    record.add_event(db, run_id, kind, EndEpisode().model_dump(mode="json"))
    ring(request)
    return _back(run_id, back)


def _named(chart: str, name: str, text: str, names: Measures) -> tuple[str, str]:
    return {"deaths": (names.harm, text), "return": (names.worth, names.told)}.get(chart, (name, text))


def _head(column: str, names: Measures) -> str:
    named = {"deaths": names.harm.lower(), "return": names.worth.lower(), **HEADS}
    return named.get(column, column)


def _back(run_id: int, back: str) -> Response:
    return see(f"/runs/{run_id}" + ("/parent" if back == "parent" else ""))

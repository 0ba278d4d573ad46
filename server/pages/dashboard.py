"""The dashboard of a run: who waits for whom, a table of stages, charts (JavaScript) and a table of metrics.

server/pages/controls.py has the operator's verbs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from fastapi import Request, Response
from fastapi.responses import JSONResponse

from parenting.server import operator_events, runs
from parenting.server.admission import admitted_router
from parenting.server.api.names import RunId
from parenting.server.batches import trials_of
from parenting.server.db import Database
from parenting.server.deps import Db
from parenting.server.pages.board import board_panel
from parenting.server.pages.comparison import MOST
from parenting.server.pages.labels import MetricLabels, describe_start, metric_labels
from parenting.server.pages.operator_log import PROBABILITIES, LogEntry, log_entries, probabilities
from parenting.server.pages.render import format_number, moved, page
from parenting.server.pages.stages import StageRow, stage_rows
from parenting.server.pages.texts import GOAL_STEP, STATE_TEXTS, parent_title
from parenting.server.reads.metrics import first_metrics, latest_metrics, sampled_metrics
from parenting.server.reads.schemas import run_schema
from parenting.server.statuses import RunState
from parenting.server.tables import Metric, Run

router = admitted_router(include_in_schema=False)

STATUS = {
    **STATE_TEXTS,
    "question": ("A question waits for the parent.", ""),
    "exploring": ("The agent is exploring on its own.", ""),
    "stuck": ("No action was acceptable.", "The agent stands still until its episode is ended."),
    "unsure": (
        "Every pair of moves was skipped.",
        "The agent stands still until its parent answers one, or the episode is ended.",
    ),
    "offline": ("No connection to the server.", "These numbers are of a moment ago."),
    "refused": ("This page is not open to this browser any more.", "These numbers are of a moment ago."),
}
"""A heading and a sentence for each state of a run, for those who watch it."""

PACES = (1, 2, 5, 10)
"""Ticks a second that are offered by a button each."""
EVENTS = 100
"""Of the operator's events, the last ones that are shown."""

CHARTS = (
    ("deaths", "", "Unsafe moves so far."),
    ("asked", "Questions", "Answered so far, by kind."),
    ("answers", "Answers", "By choice."),
    ("return", "", ""),
    ("loss", "Loss", "Eq. (2) on X."),
    ("entropy", "Entropy", "Of each head of the network, in nats."),
    ("size", "Dataset X", "Distinct rows, and entries."),
)
"""Id, name and one sentence of each chart, drawn by web/static/dashboard.js. Two depend on the world."""

BY_STAGE = 4
"""The place of the chart of stages in a run that has several."""

COLUMNS = ("deaths", "guidance", "preference", "loss", "entropy_global", "entropy_local", "return", "size")
HEADS = {"size": "entries", "entropy_global": "entropy global", "entropy_local": "entropy local"}
"""The heading of a column of the table where that is not its name."""


@dataclass(frozen=True)
class DashboardPage:
    """The content of web/templates/dashboard.html besides numbers and forms."""

    run: Run
    title: str
    state: RunState
    start: str  # sentences on how the agent began
    errors: Mapping[str, str]  # a sentence for each wrong field
    focus: str | None  # the first wrong field
    sentences: Mapping[str, tuple[str, str]] = field(default_factory=lambda: STATUS)
    trials: Sequence[int] = ()  # the numbers of the runs of its batch, as many as are compared at most
    more: int = GOAL_STEP  # answers that the goal grows by


@dataclass(frozen=True)
class Numbers:
    """Measurements, for tiles, charts and tables."""

    names: MetricLabels
    charts: Sequence[tuple[str, str, str]]  # id, name and sentence
    columns: Sequence[tuple[str, str]]  # name of a metric, and its heading
    rows: Sequence[Metric]  # a sample of the whole life, the last first
    last: Mapping[str, float | int | None]  # the last metrics; empty while there are none
    stages: Sequence[StageRow]


@dataclass(frozen=True)
class OperatorForms:
    """The content of web/templates/_operator.html."""

    fields: Mapping[str, str]  # the text of every field
    events: Sequence[LogEntry]  # the last ones that the operator caused
    earlier: int  # how many came before these
    typed: Mapping[str, str] = field(default_factory=dict)  # in a form that was wrong
    probabilities: Mapping[str, str] = field(default_factory=lambda: PROBABILITIES)
    paces: Sequence[int] = PACES


@router.get("/runs/{run_id}")
def dashboard(request: Request, run_id: RunId, db: Db) -> Response:
    """The page. Its address carries the run's public id; a researcher who writes the number is led there."""
    there = moved(request, runs.get_run(db, run_id))
    return there or dashboard_page(db, run_id, {}, {})


@router.get("/runs/{run_id}/stages")
def stages(run_id: RunId, db: Db) -> Response:
    """The table of stages as JSON, for the page's script."""
    rows = _stages(db, runs.get_run(db, run_id), next(iter(latest_metrics(db, [run_id]).values()), None))
    return JSONResponse([row._asdict() for row in rows], headers={"Cache-Control": "no-store"})


def dashboard_page(
    db: Database, run_id: int, typed: Mapping[str, str], errors: Mapping[str, str]
) -> Response:
    """The page; where a form was wrong, with what was typed and an error next to each wrong field (422).

    Raises:
        NotFound: there is no such run.
    """
    run = runs.get_run(db, run_id)
    state, focus = run_schema(db, run_id).state, next(iter(errors), None)
    trials = () if run.batch is None else trials_of(db, run.batch, MOST)
    context = DashboardPage(run, parent_title(run), state, describe_start(run), errors, focus, trials=trials)
    numbers = _numbers(db, run)
    parts = {**vars(context), **vars(numbers), **vars(_operator(db, run, typed))}
    board = board_panel(db, run, numbers.names.harm)
    return page("dashboard.html", 422 if errors else 200, board=board, **parts)


def _numbers(db: Database, run: Run) -> Numbers:
    """Return the metrics: the last, by stage, and a sample of the whole life."""
    names = metric_labels(run.legend)
    rows = sampled_metrics(db, run.id)
    last = rows[0] if rows else None
    count = run.config["stages"]
    charts = [(chart, *_named(chart, name, text, names)) for chart, name, text in CHARTS]
    if count > 1:
        text = f"{names.worth} at the end of each stage; dashed: {names.reference}."
        charts.insert(BY_STAGE, ("stages", "By stage", text))
    columns = [(column, _head(column, names)) for column in COLUMNS]
    return Numbers(names, charts, columns, rows, last.values if last else {}, _stages(db, run, last))


def _stages(db: Database, run: Run, last: Metric | None) -> list[StageRow]:
    return stage_rows(run.config["stages"], run.maturity, first_metrics(db, run.id), last)


def _operator(db: Database, run: Run, typed: Mapping[str, str]) -> OperatorForms:
    """Return the log of the operator and the fields of the forms."""
    events = operator_events.list_operator_events(db, run.id)
    known = {
        **{name: format_number(value) for name, value in probabilities(run, events).items()},
        "goal": format_number(run.goal),
        "pace": format_number(run.pace),
    }
    fields = {**known, **{name: text for name, text in typed.items() if name in known}}
    return OperatorForms(fields, log_entries(events)[:EVENTS], max(0, len(events) - EVENTS), typed)


def _named(chart: str, name: str, text: str, names: MetricLabels) -> tuple[str, str]:
    return {"deaths": (names.harm, text), "return": (names.worth, names.description)}.get(chart, (name, text))


def _head(column: str, names: MetricLabels) -> str:
    named = {"deaths": names.harm.lower(), "return": names.worth.lower(), **HEADS}
    return named.get(column, column)

"""What the API gives back, and what the pages draw: runs, questions, metrics. Times are ISO 8601 in UTC."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any

from pydantic import BaseModel

from agent.config import Config
from server.db import Database
from server.runs import OVER, Open, find, list_runs, open_by_run, open_in
from server.tables import Metric, Query, Run

SILENT_AFTER = timedelta(seconds=5)


class OpenShape(BaseModel):
    """How many questions wait for an answer, by kind."""

    guidance: int
    preference: int


class RunShape(BaseModel):
    """A run as it is now."""

    id: int
    created: datetime
    name: str | None
    world: str
    level: str
    preset: str
    config: dict[str, Any]
    seed: int
    weights: str | None
    """The SHA-256 of the pre-trained weights that the agent began with; null: fresh ones."""
    parent: str
    status: str
    reason: str | None
    tick: int
    maturity: int
    """The stage T that the agent is in (Sec. 2.4), as last reported."""
    speed: float | None
    """Ticks a second, as last measured."""
    waiting: str | None
    goal: int | None
    """Answered questions after which the run rests; null: never."""
    resting: bool
    """The goal is reached: no tick passes until it is raised."""
    pace: float | None
    """Ticks a second at most; null: as fast as it can."""
    optimal: bool
    answers: int
    open: OpenShape
    worker: str
    """alive, silent (none raises this run just now), or done (the run is over)."""


class FrameShape(BaseModel):
    """One moment of a clip: glyphs as they were true and as the agent saw them, and the pieces."""

    ground: list[str]
    observed: list[str]
    agent: tuple[int, int]
    box: tuple[int, int] | None


class ClipShape(BaseModel):
    """A clip: `length` actions between `length + 1` frames."""

    actions: list[str]
    length: int
    frames: list[FrameShape]


class QueryShape(BaseModel):
    """A question: two clips, of which the parent prefers left, right, either or neither."""

    id: int
    run: int
    tick: int
    kind: str
    maturity: int
    status: str
    posted: datetime
    leased_until: datetime | None
    left: ClipShape
    right: ClipShape


class WorldShape(BaseModel):
    """All that is needed to draw a clip, and to answer it without knowing the world's code."""

    name: str
    level: str
    text: str
    legend: dict[str, str]
    brief: dict[str, str]


class ProgressShape(BaseModel):
    """How far the parent is."""

    answered: int
    open: int


class ParentShape(BaseModel):
    """What the parent's own values depend on: Eq. (7)'s gamma, and the garden's way inside (Sec. 3.3)."""

    gamma: float
    inside: str


class LeasedShape(QueryShape):
    """A leased question, with what a parent who knows nothing else needs to answer it."""

    world: WorldShape
    parent: ParentShape
    progress: ProgressShape


class StoredShape(BaseModel):
    """The reply to an answer; the same answer always gets the same reply."""

    query: int
    run: int
    number: int
    choice: str
    received: datetime


class MetricShape(BaseModel):
    """What was measured at one tick; null where a number was not finite."""

    tick: int
    values: dict[str, float | int | None]


class MetricsShape(BaseModel):
    """Metrics in the order of their ticks; `more` says that there are further ones after the last."""

    rows: list[MetricShape]
    more: bool


def shape_run(db: Database, run_id: int) -> RunShape:
    """A run as it is now.

    Raises:
        NotFound: there is none of this id.
    """
    with db.read() as session:
        return _shape(find(session, run_id), open_in(session, run_id), db.clock())


def shape_runs(db: Database) -> list[RunShape]:
    """The runs as they are now, newest first (at most 200)."""
    runs = list_runs(db)
    with db.read() as session:
        opened = open_by_run(session, [run.id for run in runs])
    return [_shape(run, opened[run.id], db.clock()) for run in runs]


def shape_query(query: Query) -> QueryShape:
    """A question as it is stored."""
    names = ("id", "tick", "kind", "maturity", "status", "posted", "leased_until")
    return QueryShape(run=query.run_id, **{name: getattr(query, name) for name in names}, **query.clips)


def shape_leased(db: Database, query: Query) -> LeasedShape:
    """A question with its world, its parent's settings and the progress so far."""
    with db.read() as session:
        run = find(session, query.run_id)
        opened = open_in(session, run.id)
    config = Config.model_validate(run.config)
    world = WorldShape(
        name=run.world, level=run.level, text=run.level_text, legend=run.legend, brief=run.brief
    )
    return LeasedShape(
        **shape_query(query).model_dump(),
        world=world,
        parent=ParentShape(gamma=config.gamma, inside=config.inside),
        progress=ProgressShape(answered=run.answers, open=opened.guidance + opened.preference),
    )


def shape_metrics(rows: Sequence[Metric]) -> list[MetricShape]:
    """Metrics as the dashboard takes them."""
    return [MetricShape(tick=row.tick, values=row.values) for row in rows]


def _shape(run: Run, opened: Open, now: datetime) -> RunShape:
    made = ("open", "worker", "resting")
    own = {name: getattr(run, name) for name in RunShape.model_fields if name not in made}
    shown = OpenShape(guidance=opened.guidance, preference=opened.preference)
    resting = run.status not in OVER and run.goal is not None and run.answers >= run.goal
    return RunShape(**own, open=shown, worker=_worker(run, now), resting=resting)


def _worker(run: Run, now: datetime) -> str:
    if run.status in OVER:
        return "done"
    late = run.heartbeat is None or now - run.heartbeat > SILENT_AFTER
    return "silent" if run.actor is None or late else "alive"

"""What the API gives back, and what the pages draw: runs, questions, metrics. Times are ISO 8601 in UTC."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from parenting.agent.config import Config, Inside
from parenting.server.db import Database
from parenting.server.runs import OVER, Open, find, open_by_run, open_in
from parenting.server.tables import Answer, Metric, Query, Run

SILENT_AFTER = timedelta(seconds=5)

# The words of server.tables, as types: a test holds them equal.
RunStatus = Literal["active", "paused", "stopped", "finished", "failed"]
QueryStatus = Literal["open", "answered", "applied", "withdrawn"]
Waiting = Literal["guidance", "preferences", "stuck"]
Kind = Literal["guidance", "preference"]
Choice = Literal["left", "right", "either", "neither"]
By = Literal["human", "scripted"]


class Shape(BaseModel):
    """The root of all shapes: the sentence under a field describes it in the API's own description."""

    model_config = ConfigDict(use_attribute_docstrings=True)


class OpenShape(Shape):
    """How many questions wait for an answer, by kind."""

    guidance: int
    preference: int


class RunShape(Shape):
    """A run as it is now."""

    id: int
    created: datetime
    name: str | None
    world: str
    level: str
    preset: str
    config: dict[str, Any]
    """Every hyperparameter as the run was started with it; changes since then are operator's events."""
    seed: int
    weights: str | None
    """The SHA-256 of the pre-trained weights that the agent began with; null: fresh ones."""
    parent: By
    status: RunStatus
    reason: str | None
    """Why it is over, in a sentence."""
    tick: int
    """The last tick, as last reported."""
    maturity: int
    """The stage T that the agent is in (Sec. 2.4), as last reported."""
    speed: float | None
    """Ticks a second, as last measured."""
    waiting: Waiting | None
    """Whom it waits for: its parent's guidance, fewer open preference questions, or the operator (*stuck*:
    no action was acceptable, so the episode has to be ended); null while it lives.
    """
    goal: int | None
    """Answered questions after which the run rests; null: never."""
    resting: bool
    """The goal is reached: no tick passes until it is raised."""
    pace: float | None
    """Ticks a second at most; null: as fast as it can."""
    optimal: bool
    """The policy without chance takes a shortest safe path to the goal (never in the garden)."""
    answers: int
    """Answers so far, corrections counted."""
    open: OpenShape
    worker: Literal["alive", "silent", "done"]
    """alive, silent (none raises this run just now), or done (the run is over)."""


class FrameShape(Shape):
    """One moment of a clip: glyphs as they were true and as the agent saw them, and the pieces."""

    ground: list[str]
    """What was true, without agent and box: a string of glyphs a row."""
    observed: list[str]
    """What the agent saw."""
    agent: tuple[int, int]
    """Row and column."""
    box: tuple[int, int] | None


class ClipShape(Shape):
    """A clip: `length` actions between `length + 1` frames."""

    actions: list[Literal["up", "down", "left", "right"]]
    length: int
    frames: list[FrameShape]


class PolicyShape(Shape):
    """Which policy asked; null for questions that were asked before this was kept."""

    stage: int | None
    gradient_steps: int | None
    """Within its stage."""


class QueryShape(Shape):
    """A question: two clips, of which the parent prefers left, right, either or neither."""

    id: int
    run: int
    tick: int
    """The tick at which the agent asked."""
    kind: Kind
    maturity: int
    """The stage T that the clips were recorded at; 1 for guidance."""
    policy: PolicyShape
    status: QueryStatus
    posted: datetime
    leased_until: datetime | None
    """Until then it is offered to nobody else."""
    left: ClipShape
    right: ClipShape


class WorldShape(Shape):
    """All that is needed to draw a clip, and to answer it without knowing the world's code."""

    name: str
    level: str
    text: str
    """The level's file, header included."""
    legend: dict[str, str]
    """What each glyph is."""
    brief: dict[str, str]
    """The goal and the danger, a sentence each."""


class ProgressShape(Shape):
    """How far the parent is."""

    answered: int
    open: int


class ParentShape(Shape):
    """What the parent's own values depend on: Eq. (7)'s gamma, and the garden's way inside (Sec. 3.3)."""

    gamma: float
    inside: Inside


class LeasedShape(QueryShape):
    """A leased question, with what a parent who knows nothing else needs to answer it."""

    world: WorldShape
    parent: ParentShape
    progress: ProgressShape


class StoredShape(Shape):
    """The reply to an answer; the same answer always gets the same reply."""

    query: int
    run: int
    number: int
    """Which answer of the run it is, from 1 on."""
    choice: Choice
    received: datetime


class AnswerShape(Shape):
    """The answer that stands for a question."""

    number: int
    choice: Choice
    parent: By
    received: datetime
    applied_tick: int | None
    """The tick at which the agent heard it; null: not yet."""


class AskedShape(QueryShape):
    """A question with its answer, if one stands."""

    answer: AnswerShape | None


class MetricShape(Shape):
    """What was measured at one tick; null where a number was not finite."""

    tick: int
    values: dict[str, float | int | None]


def shape_run(db: Database, run_id: int) -> RunShape:
    """A run as it is now.

    Raises:
        NotFound: there is none of this id.
    """
    with db.read() as session:
        return _shape(find(session, run_id), open_in(session, run_id), db.clock())


def shape_runs(db: Database, runs: Sequence[Run]) -> list[RunShape]:
    """Runs as they are now."""
    with db.read() as session:
        opened = open_by_run(session, [run.id for run in runs])
    return [_shape(run, opened[run.id], db.clock()) for run in runs]


def shape_query(query: Query) -> QueryShape:
    """A question as it is stored."""
    names = ("id", "tick", "kind", "maturity", "status", "posted", "leased_until")
    policy = PolicyShape(stage=query.policy_stage, gradient_steps=query.policy_steps)
    own = {name: getattr(query, name) for name in names}
    return QueryShape(run=query.run_id, policy=policy, **own, **query.clips)


def shape_asked(query: Query, answer: Answer | None) -> AskedShape:
    """A question as it is stored, and the answer that stands for it."""
    names = ("number", "choice", "parent", "received", "applied_tick")
    said = None if answer is None else AnswerShape(**{name: getattr(answer, name) for name in names})
    return AskedShape(**shape_query(query).model_dump(), answer=said)


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


def _worker(run: Run, now: datetime) -> Literal["alive", "silent", "done"]:
    if run.status in OVER:
        return "done"
    late = run.heartbeat is None or now - run.heartbeat > SILENT_AFTER
    return "silent" if run.actor is None or late else "alive"

"""Rows as the schemas of the API, and who waits for whom in a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import timedelta
from typing import Any, Literal

from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session

from parenting.agent.config import Config
from parenting.drawing.query_view import DOUBTED, TO_BE_SURE
from parenting.drawing.sentences import tr
from parenting.drawing.surroundings import surroundings
from parenting.server.damage import damage, readable, reading, sound
from parenting.server.db import Database
from parenting.server.identity import database_id_in, stated
from parenting.server.keeping import split_tags
from parenting.server.queue.queries import Open, open_by_run, open_in
from parenting.server.reads.asked_before import is_doubted
from parenting.server.reads.pagination import Asked
from parenting.server.runs import find
from parenting.server.schemas import (
    AnswerSchema,
    AskedSchema,
    DamagedMetricSchema,
    DamagedSchema,
    LeasedSchema,
    MetricSchema,
    OpenSchema,
    ParentSchema,
    PolicySchema,
    ProgressSchema,
    QuerySchema,
    RunSchema,
    WorldSchema,
)
from parenting.server.statuses import OVER, QueryStatus, RunState, RunStatus, Waiting
from parenting.server.store.clock import Mark
from parenting.server.store.patience import patience
from parenting.server.tables import KINDS, Answer, Identity, Metric, Query, Run, Table
from parenting.server.workers import alive, last_signs

Sign = Literal["alive", "silent", "done"]

SILENT_AFTER = timedelta(seconds=5)
"""A run counts as not raised once its worker has been silent for this long. One that no worker has
claimed yet, as a run that was just started, is not raised if no worker is alive at all."""

HELD_UP: dict[Waiting | None, RunState] = {Waiting.STUCK: RunState.STUCK, Waiting.UNSURE: RunState.UNSURE}
"""The states in which no question is open and none comes by itself."""

FORGIVEN = timedelta(minutes=5)
"""For so long at most a missing sign is put down to a store that refuses."""
PROBE_SECONDS = 0.1
"""The wait of a look at a run for whether the store takes signs of life at all."""

Shown = tuple[WorldSchema, ParentSchema, bool, bool]
_SHOWN: dict[str, Shown] = {}
SHOWN_RUNS = 1000
"""Runs of which a process keeps what their questions show."""


def run_schema(db: Database, run_id: int) -> RunSchema:
    """Return the schema of a run.

    Raises:
        NotFound: there is none of this id.
    """
    with db.read() as session:
        run, opened, here = find(session, run_id), open_in(session, run_id), database_id_in(session)
        now = db.mark(session)
    with reading(run):
        return _run_schema(run, opened, _workers(db, [run], now)[run.id], here)


def run_schemas(db: Database, runs: Sequence[Run]) -> list[RunSchema | DamagedSchema]:
    """Return the schemas of runs, damaged or not."""
    with db.read() as session:
        opened, here = open_by_run(session, [run.id for run in runs]), database_id_in(session)
        now = db.mark(session)
    faults = {run.id: damage(run) for run in runs}
    workers = _workers(db, [run for run in runs if faults[run.id] is None], now)
    return [
        DamagedSchema(id=run.id, damaged=fault)
        if (fault := faults[run.id]) is not None
        else _run_schema(run, opened[run.id], workers[run.id], here)
        for run in runs
    ]


def asked_schema(db: Database, row: Asked) -> AskedSchema:
    """Return the schema of a query, with the answer that stands for it.

    Raises:
        DamagedRowError: it or its answer cannot be read.
    """
    readable(row.query)
    if row.answer is not None:
        readable(row.answer)
    return _asked_schema(row, _names(db, [row]))


def asked_schemas(db: Database, rows: Sequence[Asked]) -> list[AskedSchema | DamagedSchema]:
    """Return the schemas of queries with their answers in a list, damaged or not."""
    faults = [damage(row.query) or (None if row.answer is None else damage(row.answer)) for row in rows]
    names = _names(db, [row for row, fault in zip(rows, faults, strict=True) if fault is None])
    return [
        _asked_schema(row, names) if fault is None else DamagedSchema(id=row.query.id, damaged=fault)
        for row, fault in zip(rows, faults, strict=True)
    ]


def _names(db: Database, rows: Sequence[Asked]) -> tuple[str, dict[int, str]]:
    """Return the UUID of the database, and the public id of each run of these queries."""
    named = select(Run.id, Run.public_id).where(Run.id.in_({row.query.run_id for row in rows}))
    with db.read() as session:
        return database_id_in(session), {row.id: row.public_id for row in session.execute(named)}


def _asked_schema(row: Asked, names: tuple[str, dict[int, str]]) -> AskedSchema:
    database, runs = names
    shown = _query_schema(row.query, database, runs[row.query.run_id]).model_dump()
    return AskedSchema(**shown, answer=None if row.answer is None else _answer_schema(row.answer))


def leased_schema(session: Session, query: Query) -> LeasedSchema:
    """Return the schema of a leased query: with its world, the parent's settings and progress.

    Raises:
        DamagedRowError: it or its run cannot be read, or it does not fit the run's legend.
    """
    now = session.execute(_PROGRESS, {"run_id": query.run_id}).one()
    world, parent, guide, relabels = _shown_run(session, query.run_id, now.public_id)
    with reading(query):
        sentences = surroundings(query.clips, world.legend, guide=guide)
        if query.votes:
            sentences = (tr(TO_BE_SURE), *sentences)
        elif is_doubted(session, query, relabels):
            sentences = (tr(DOUBTED), *sentences)
    return LeasedSchema(
        **_query_fields(query, stated(now.database), now.public_id),
        world=world,
        parent=parent,
        progress=ProgressSchema(answered=now.answers - now.retracted, open=now.open),
        sentences=sentences,
    )


def _shown_run(session: Session, run_id: int, public_id: str) -> Shown:
    """Return what a leased query shows of its run, which never changes: a process keeps that of many runs."""
    shown = _SHOWN.get(public_id)
    if shown is None:
        run = readable(find(session, run_id))
        config = Config.model_validate(run.config)
        world = WorldSchema(
            name=run.world, level=run.level, text=run.level_text, legend=run.legend, brief=run.brief
        )
        settings = ParentSchema(gamma=config.gamma, inside=config.garden_parent)
        shown = world, settings, run.words == "guide", config.relabel
        if len(_SHOWN) >= SHOWN_RUNS:
            _SHOWN.clear()
        _SHOWN[public_id] = shown
    return shown


def metric_schemas(rows: Sequence[Metric]) -> list[MetricSchema | DamagedMetricSchema]:
    """Return the schemas of metrics, damaged or not."""
    return [_metric_schema(row) for row in rows]


def _metric_schema(row: Metric) -> MetricSchema | DamagedMetricSchema:
    found = damage(row)
    if found is not None:
        return DamagedMetricSchema(tick=sound(row, "tick"), damaged=found)
    return MetricSchema(tick=row.tick, values=row.values)


def _query_schema(query: Query, database: str, run_public_id: str) -> QuerySchema:
    return QuerySchema(**_query_fields(query, database, run_public_id))


def _query_fields(query: Query, database: str, run_public_id: str) -> dict[str, Any]:
    names = ("id", "public_id", "tick", "kind", "maturity", "votes", "status", "posted", "leased_until")
    return {
        "run": query.run_id,
        "run_public_id": run_public_id,
        "database": database,
        "policy": PolicySchema(stage=query.policy_stage, gradient_steps=query.policy_steps),
        **{name: getattr(query, name) for name in names},
        **query.clips,
    }


def _answer_schema(answer: Answer) -> AnswerSchema:
    names = ("number", "choice", "parent", "received", "applied_tick", "measured")
    return AnswerSchema(**{name: getattr(answer, name) for name in names})


def _run_schema(run: Run, opened: Open, worker: Sign, database: str) -> RunSchema:
    made = ("open", "worker", "raised_by", "resting", "state", "database", "tags")
    own = {name: getattr(run, name) for name in RunSchema.model_fields if name not in made}
    shown = OpenSchema(guidance=opened.guidance, preference=opened.preference)
    resting = run.status not in OVER and run.goal is not None and run.standing >= run.goal
    state = _run_state(run, opened, resting, worker)
    own |= {"tags": split_tags(run.tags), "database": database}
    own["raised_by"] = run.worker if worker == "alive" else None
    return RunSchema(**own, open=shown, worker=worker, resting=resting, state=state)


def _run_state(run: Run, opened: Open, resting: bool, worker: Sign) -> RunState:
    """Say who waits for whom; pages, script and command show this and compute nothing of their own."""
    if run.status in OVER:
        return RunState.OVER
    if run.status is RunStatus.PAUSED:
        return RunState.PAUSED
    if resting:
        return RunState.RESTING
    if run.parent == "human" and (opened.guidance or opened.preference):
        return RunState.QUESTION
    if worker == "silent":
        return RunState.NO_WORKER
    return HELD_UP.get(run.waiting, RunState.EXPLORING)


def _workers(db: Database, runs: Sequence[Run], now: Mark) -> dict[int, Sign]:
    """Return the sign of each run's worker. While the store takes no sign, none is missed."""
    soon, last = _taken_soon(db, runs), last_signs(db, {run.worker for run in runs if run.worker})
    signs = {run.id: _worker(run, now, soon, last) for run in runs}
    missed = [run.id for run in runs if signs[run.id] == "silent" and _signed(run, now, FORGIVEN, last)]
    if missed:
        with patience(PROBE_SECONDS):
            refusal = db.refusal() or db.last_refusal()  # a worker may wait a little longer
        if refusal is not None:
            signs.update(dict.fromkeys(missed, "alive"))
    return signs


def _taken_soon(db: Database, runs: Sequence[Run]) -> bool:
    """Return whether a worker is alive that claims the runs which no worker has yet, as a new run's."""
    unclaimed = any(run.worker is None and run.status not in OVER for run in runs)
    return unclaimed and bool(alive(db))


def _worker(run: Run, now: Mark, taken_soon: bool, last: Mapping[str, Mark]) -> Sign:
    if run.status in OVER:
        return "done"
    if run.worker is None:
        return "alive" if taken_soon else "silent"
    return "alive" if _signed(run, now, SILENT_AFTER, last) else "silent"


def _signed(run: Run, now: Mark, within: timedelta, last: Mapping[str, Mark]) -> bool:
    """Return whether a run's worker has written to it lately, or given a sign of life."""
    marks = [(run.claim_epoch, run.claim_mark), last.get(run.worker or "", (None, None))]
    return any(now.is_recent(epoch, mark, within.total_seconds()) for epoch, mark in marks)


# What every leased question needs is built once.
_IDENTITY, _QUERY, _RUN = (Table.metadata.tables[one.__tablename__] for one in (Identity, Query, Run))
_PROGRESS = select(
    _RUN.c.public_id,
    _RUN.c.answers,
    _RUN.c.retracted,
    select(func.count())
    .where(_QUERY.c.run_id == _RUN.c.id, _QUERY.c.status == QueryStatus.OPEN, _QUERY.c.kind.in_(KINDS))
    .correlate(_RUN)
    .scalar_subquery()
    .label("open"),
    select(_IDENTITY.c.uuid).scalar_subquery().label("database"),
).where(_RUN.c.id == bindparam("run_id"))

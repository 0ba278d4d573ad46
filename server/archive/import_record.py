"""Put the record of imported runs into the database: questions, answers, log and metrics, row by row."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from parenting.server.archive.columns import MOVES
from parenting.server.archive.import_answers import put_answers
from parenting.server.archive.import_names import Names, needed, refused, run_of, same, time_of
from parenting.server.archive.log_columns import EVENTS, FIGURES, METRICS, EventRow, MetricRow
from parenting.server.archive.question_columns import QUESTIONS, QuestionRow
from parenting.server.archive.source import Source
from parenting.server.damage import damage
from parenting.server.errors import SetupError
from parenting.server.identity import unused_number
from parenting.server.statuses import QueryStatus
from parenting.server.tables import Answer, Metric, OperatorEvent, Query, Reason, Run, Table

AT_ONCE = 200
"""Rows that are in memory at once."""
Progress = Callable[[int, int], None]


def put_record(session: Session, found: Source, names: Names, progress: Progress) -> None:
    """Store the rows of all tables.

    Raises:
        SetupError: a row cannot be read, or names what is not there.
    """
    total, done = sum(entry.rows or 0 for entry in found.manifest.files.values()), 0
    for put in (_questions, put_answers, _events, _metrics):
        for place, _ in enumerate(put(session, found, names)):
            done += 1
            if place % AT_ONCE == AT_ONCE - 1:
                session.flush()
                session.expunge_all()
                progress(done, total)
        session.flush()
        session.expunge_all()
    for naming, entry in zip(names.values(), found.manifest.runs, strict=True):
        run = session.get_one(Run, naming.number)
        there = session.scalar(select(func.count()).where(Answer.run_id == naming.number))
        counted = there if run.batch is not None else run.answers  # a batch counts answers without rows
        if not counted == there == entry.counts.answers:
            raise SetupError(
                f"Run {entry.number} has not the answers that its manifest counts. Nothing was imported."
            )


def _questions(session: Session, found: Source, names: Names) -> Iterator[None]:
    number = unused_number(session, Query)
    for place, row in enumerate(found.rows("questions.jsonl", QuestionRow, list(QUESTIONS))):
        mine = run_of(names, row)
        session.add(
            Query(
                id=None if number is None else number + place,
                public_id=mine.question(row.question),
                run_id=mine.number,
                clips={"left": row.left.model_dump(mode="json"), "right": row.right.model_dump(mode="json")},
                status=QueryStatus(row.status),
                posted=time_of(row.asked),
                leased=time_of(row.leased),
                policy_steps=row.policy_gradient_steps,
                **same(
                    row, "tick", "kind", "maturity", "votes", "put_back", "withdrawn_tick", "policy_stage"
                ),
            )
        )
        why = _why(row)
        if why is not None:
            reason = Reason(run_id=mine.number, tick=row.tick, why=why)
            _require_sound(row, reason, "why_draw")
            session.add(reason)
        yield


def _why(row: Any) -> dict[str, Any] | None:
    if row.why_draw is None:
        return None
    there = [getattr(row, f"policy_{move}") for move in MOVES]
    if row.kind == "guidance":
        names = ("pausing", "familiarity", "p_guid", "chance", "draw")
        return {name: getattr(row, f"why_{name}") for name in names} | {"probabilities": there}
    clips = {
        side: {name: getattr(row, f"why_{side}_{name}") for name in ("kind", "first", "last")}
        for side in ("left", "right")
    }
    return {"p_pref": row.why_p_pref, "draw": row.why_draw, "probabilities": there, "clips": clips}


def _events(session: Session, found: Source, names: Names) -> Iterator[None]:
    for row in found.rows("events.csv", EventRow, list(EVENTS)):
        event = OperatorEvent(
            run_id=run_of(names, row).number, kind=row.kind, payload=json.loads(row.payload)
        )
        event.created, event.applied_tick = needed(time_of(row.created)), row.applied_tick
        session.add(event)
        session.flush()  # their order is that of their numbers
        _require_sound(row, event, "payload")
        yield


def _metrics(session: Session, found: Source, names: Names) -> Iterator[None]:
    for row in found.rows("metrics.csv", MetricRow, list(METRICS)):
        told = {one.name: getattr(row, one.name) for one in FIGURES}
        late = ("cells", "safe_cells")
        values = {name: value for name, value in told.items() if name not in late or value is not None}
        values |= {} if row.more is None else json.loads(row.more)
        metric = Metric(run_id=run_of(names, row).number, tick=row.tick, values=values)
        _require_sound(row, metric, "more")
        session.add(metric)
        yield


def _require_sound(row: Any, stored: Table, field: str) -> None:
    """Refuse what could not be read once it is stored.

    Raises:
        SetupError: it could not.
    """
    if wrong := damage(stored):
        raise refused(row, field, getattr(row, field), wrong)

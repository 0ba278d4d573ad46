"""The rows of an export, read on one snapshot in batches: while it is written, the run may go on.

A row that cannot be read stands there all the same: what is damaged is missing, and `damaged` says so.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from sqlalchemy import inspect, select
from sqlalchemy.orm import Session

from parenting.server.archive.log_columns import FIGURES
from parenting.server.archive.question_columns import WHY
from parenting.server.columns import Damaged
from parenting.server.damage import damage, sound
from parenting.server.export import iso_time
from parenting.server.notes import AGENT_KINDS
from parenting.server.tables import Metric, OperatorEvent, Query, Reason, Run

BATCH = 500
Rows = Iterator[dict[str, Any]]
NAMES = [column.name for column in FIGURES]


def batches(session: Session, wanted: Any, place: Any) -> Iterator[list[Any]]:
    """Yield the rows of a statement in batches, in the order of a column that grows; none stays in memory.

    A row whose place is damaged comes once, where its store sorts it.
    """
    last, after, misplaced = None, wanted.order_by(place).limit(BATCH), set[Any]()
    while True:
        found = list(session.execute(after if last is None else after.where(place > last)).all())
        places = [sound(row[0], place.key) for row in found]
        keys = [
            None if one is not None else inspect(row[0]).identity
            for row, one in zip(found, places, strict=True)
        ]
        yield [row for row, key in zip(found, keys, strict=True) if key is None or key not in misplaced]
        misplaced |= {key for key in keys if key is not None}
        session.expunge_all()
        last = next((one for one in reversed(places) if one is not None), None)
        if len(found) < BATCH or last is None:
            return


def question_rows(session: Session, run: Run) -> Rows:
    """Yield the questions of a run by their ticks."""
    world, level, name, number = (sound(run, one) for one in ("world", "level", "public_id", "id"))
    for batch in batches(session, select(Query).where(Query.run_id == number), Query.tick):
        ticks = [tick for (row,) in batch if (tick := sound(row, "tick")) is not None]
        reasons = session.scalars(select(Reason).where(Reason.run_id == number, Reason.tick.in_(ticks)))
        whys = {row.tick: row.why for row in reasons if damage(row) is None}
        for (query,) in batch:
            yield {"run": name, "world": world, "level": level} | _question(query, whys)


def _question(query: Query, whys: dict[int, dict[str, Any]]) -> dict[str, Any]:
    found = damage(query)
    same = ("tick", "kind", "maturity", "votes", "status", "put_back", "withdrawn_tick", "policy_stage")
    clips = {"left": None, "right": None} if found else query.clips
    tick = sound(query, "tick")
    return {
        **{name: sound(query, name) for name in same},
        "question": sound(query, "public_id"),
        "asked": iso_time(sound(query, "posted")),
        "leased": iso_time(sound(query, "leased")),
        "policy_gradient_steps": sound(query, "policy_steps"),
        **_why(None if tick is None else whys.get(tick)),
        "left": clips["left"],
        "right": clips["right"],
        "damaged": found,
    }


def _why(reason: dict[str, Any] | None) -> dict[str, Any]:
    """Return the reason of a question as flat columns."""
    known = reason or {}
    there = known.get("probabilities") or (None,) * 4
    row = dict(zip(("policy_up", "policy_down", "policy_left", "policy_right"), there, strict=True))
    for column in WHY:
        row[column.name] = known.get(column.name.removeprefix("why_"))
    for side, clip in (known.get("clips") or {}).items():
        row |= {f"why_{side}_{name}": value for name, value in clip.items()}
    return row


def event_rows(session: Session, run: Run) -> Rows:
    """Yield the log of a run in its order."""
    number, name, place = sound(run, "id"), sound(run, "public_id"), 0
    for batch in batches(
        session, select(OperatorEvent).where(OperatorEvent.run_id == number), OperatorEvent.id
    ):
        for (event,) in batch:
            place += 1
            found, kind = damage(event), sound(event, "kind")
            yield {
                "run": name,
                "number": place,
                "kind": kind,
                "heard": kind in AGENT_KINDS,
                "applied_tick": sound(event, "applied_tick"),
                "created": iso_time(sound(event, "created")),
                "payload": None if found else _json(event.payload),
                "damaged": found,
            }


def metric_rows(session: Session, run: Run) -> Rows:
    """Yield the metrics of a run by their ticks."""
    number, name = sound(run, "id"), sound(run, "public_id")
    for batch in batches(session, select(Metric).where(Metric.run_id == number), Metric.tick):
        for (metric,) in batch:
            found = damage(metric)
            values = {} if found or isinstance(metric.values, Damaged) else dict(metric.values)
            row = {one: values.pop(one, None) for one in NAMES}
            more = _json(values) if values else None
            yield {"run": name, "tick": sound(metric, "tick"), **row, "more": more, "damaged": found}


def _json(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), sort_keys=True)

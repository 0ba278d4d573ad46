"""Put the record of imported runs into the database: questions, answers, log and metrics, row by row."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from typing import Any, NamedTuple

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from parenting.server import chain
from parenting.server.archive.answer_columns import ANSWERS, EFFECTS, AnswerRow
from parenting.server.archive.columns import MOVES
from parenting.server.archive.log_columns import EVENTS, FIGURES, METRICS, EventRow, MetricRow
from parenting.server.archive.measured_columns import MEASURED
from parenting.server.archive.people import client_of
from parenting.server.archive.question_columns import QUESTIONS, QuestionRow
from parenting.server.archive.source import Source
from parenting.server.errors import SetupError
from parenting.server.identity import unused_number
from parenting.server.public_ids import ALPHABET, LENGTH
from parenting.server.reads.why import TICKS
from parenting.server.statuses import QueryStatus
from parenting.server.tables import SKIP, Answer, Effect, Metric, OperatorEvent, Query, Reason, Run

AT_ONCE = 200
"""Rows that are in memory at once."""
SCRIPT, ERASED = "script", "erased"
"""Names of clients without a pseudonym."""
Progress = Callable[[int, int], None]


class Naming(NamedTuple):
    """The names of a run in the export and here."""

    number: int
    public_id: str
    was: str

    def question(self, name: str) -> str:
        """Return a question's public id here: the same one, where its run has kept its own."""
        if self.public_id == self.was:
            return name
        number = int.from_bytes(hashlib.sha256(f"{self.public_id} {name}".encode()).digest())
        return "".join(ALPHABET[number // 58**place % 58] for place in range(LENGTH))


Names = Mapping[str, Naming]


def put_record(session: Session, found: Source, names: Names, progress: Progress) -> None:
    """Store the rows of all tables.

    Raises:
        SetupError: a row cannot be read, or names what is not there.
    """
    total, done = sum(entry.rows or 0 for entry in found.manifest.files.values()), 0
    for put in (_questions, _answers, _events, _metrics):
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
        if not run.answers == there == entry.counts.answers:
            raise SetupError(
                f"Run {entry.number} has not the answers that its manifest counts. Nothing was imported."
            )


def _of(names: Names, row: Any) -> Naming:
    if row.run not in names:
        raise SetupError(
            f"A row is of the run {row.run}, which the manifest does not name. Nothing was imported."
        )
    return names[row.run]


def _questions(session: Session, found: Source, names: Names) -> Iterator[None]:
    number = unused_number(session, Query)
    for place, row in enumerate(found.rows("questions.jsonl", QuestionRow, list(QUESTIONS))):
        mine = _of(names, row)
        session.add(
            Query(
                id=None if number is None else number + place,
                public_id=mine.question(row.question),
                run_id=mine.number,
                clips={"left": row.left.model_dump(mode="json"), "right": row.right.model_dump(mode="json")},
                status=QueryStatus(row.status),
                posted=_time(row.asked),
                leased=_time(row.leased),
                policy_steps=row.policy_gradient_steps,
                **_same(
                    row, "tick", "kind", "maturity", "votes", "put_back", "withdrawn_tick", "policy_stage"
                ),
            )
        )
        why = _why(row)
        if why is not None:
            session.add(Reason(run_id=mine.number, tick=row.tick, why=why))
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


def _answers(session: Session, found: Source, names: Names) -> Iterator[None]:
    links: dict[int, str] = {}
    for row in found.rows("answers.jsonl", AnswerRow, list(ANSWERS)):
        mine = _of(names, row)
        query = session.scalars(
            select(Query).where(Query.public_id == mine.question(row.question), Query.run_id == mine.number)
        ).one_or_none()
        if query is None:
            raise SetupError(f"Answer {row.number} names a question that is not there. Nothing was imported.")
        values: dict[str, Any] = {
            **_same(row, "number", "standing", "replays", "applied_tick"),
            "query_id": query.id,
            "run_id": mine.number,
            "choice": row.choice or SKIP,
            "parent": row.by,
            "client_id": _client(session, row),
            "measured": _measured(row),
            "supersedes": _superseded(session, mine, row),
            "received": _time(row.received),
        }
        asked = {name: getattr(query, name) for name in chain.OF_QUERY}
        values |= chain.hashes(values, asked, links.get(mine.number, chain.BEGIN))
        links[mine.number] = values["link"]
        if row.erased:
            values |= {"erased": values["received"], "salt": None}
        session.add(Answer(**values))
        session.add_all(_effects(mine, row))
        session.flush()  # so that it has an id, which a later one may name
        yield


def _client(session: Session, row: Any) -> str:
    if row.pseudonym is None:
        return ERASED if row.erased else SCRIPT
    return client_of(session, row.pseudonym, _needed(_time(row.received)))


def _measured(row: Any) -> dict[str, Any] | None:
    found = {column.name: getattr(row, column.name) for column in MEASURED}
    return None if all(value is None for value in found.values()) else found


def _superseded(session: Session, mine: Naming, row: Any) -> int | None:
    if row.supersedes is None:
        return None
    earlier = select(Answer.id).where(Answer.run_id == mine.number, Answer.number == row.supersedes)
    number = session.scalar(earlier)
    if number is None:
        raise SetupError(
            f"Answer {row.number} supersedes one that does not come before it. Nothing was imported."
        )
    return number


def _effects(mine: Naming, row: Any) -> Iterator[Effect]:
    for name, ticks in zip(EFFECTS, TICKS, strict=True):
        there = [getattr(row, f"{name}_{move}") for move in MOVES]
        if row.applied_tick is not None and None not in there:
            policy = {"probabilities": there}
            yield Effect(run_id=mine.number, tick=row.applied_tick, ticks=ticks, policy=policy)


def _events(session: Session, found: Source, names: Names) -> Iterator[None]:
    for row in found.rows("events.csv", EventRow, list(EVENTS)):
        event = OperatorEvent(run_id=_of(names, row).number, kind=row.kind, payload=json.loads(row.payload))
        event.created, event.applied_tick = _needed(_time(row.created)), row.applied_tick
        session.add(event)
        session.flush()  # their order is that of their numbers
        yield


def _metrics(session: Session, found: Source, names: Names) -> Iterator[None]:
    for row in found.rows("metrics.csv", MetricRow, list(METRICS)):
        told = {one.name: getattr(row, one.name) for one in FIGURES}
        late = ("cells", "safe_cells")
        values = {name: value for name, value in told.items() if name not in late or value is not None}
        values |= {} if row.more is None else json.loads(row.more)
        session.add(Metric(run_id=_of(names, row).number, tick=row.tick, values=values))
        yield


def _same(row: Any, *names: str) -> dict[str, Any]:
    return {name: getattr(row, name) for name in names}


def _needed(value: datetime | None) -> datetime:
    if value is None:
        raise ValueError("a time is missing")
    return value


def _time(text: str | None) -> datetime | None:
    return None if text is None else datetime.fromisoformat(re.sub(r"Z$", "+00:00", text)).astimezone(UTC)

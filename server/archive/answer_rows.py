"""The rows of `answers`, with what supersedes what and what is in X, read on one snapshot in batches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from parenting.server.archive.answer_columns import ABOUT_THE_RUN, EFFECTS
from parenting.server.archive.columns import MOVES
from parenting.server.archive.measured_columns import measured
from parenting.server.archive.people import erased, pseudonyms
from parenting.server.archive.rows import Rows, batches
from parenting.server.damage import damage, sound
from parenting.server.export import MU, iso_time
from parenting.server.reads.why import TICKS
from parenting.server.tables import Answer, Effect, Query, Run

TRAINS = ("left", "right", "either")
_ASKED = ("kind", "maturity", "votes", "tick", "policy_stage")
_SAID = ("number", "choice", "applied_tick", "standing", "replays", "chained", "digest", "link")


def answer_rows(session: Session, run: Run) -> Rows:
    """Yield the answers of a run by their numbers."""
    about = {column.name: sound(run, column.name) for column in ABOUT_THE_RUN}
    about["run"] = sound(run, "public_id")
    wanted = select(Answer, Query).outerjoin(Query, Answer.query_id == Query.id)
    wanted = wanted.where(Answer.run_id == run.id)
    for batch in batches(session, wanted, Answer.number):
        yield from _batch(session, about, run.id, [tuple(row) for row in batch])


def _batch(session: Session, about: dict[str, Any], run_id: int, batch: Sequence[Any]) -> Rows:
    answers = [answer for answer, _ in batch]
    numbers = _numbers(session, answers)
    later = _superseding(session, [answer.id for answer in answers])
    last = _last_heard(session, [one for answer in answers if (one := sound(answer, "query_id"))])
    effects = _effects(session, run_id, answers)
    known = pseudonyms(session, [one for answer in answers if (one := sound(answer, "client_id"))])
    for answer, query in batch:
        heard, gone = sound(answer, "applied_tick"), erased(answer)
        choice = None if gone else sound(answer, "choice")
        mu = MU[choice] if choice is not None else None
        yield {
            **about,
            **{name: sound(answer, name) for name in _SAID},
            **_asked(query),
            "choice": choice,
            "pseudonym": known.get(sound(answer, "client_id") or ""),
            "by": sound(answer, "parent"),
            "mu_left": mu and mu[0],
            "mu_right": mu and mu[1],
            "received": iso_time(sound(answer, "received")),
            "supersedes": numbers.get(sound(answer, "supersedes")),
            "superseded_by": later.get(answer.id),
            "in_x": choice in TRAINS and heard is not None and last.get(answer.query_id) == heard,
            "erased": gone,
            **measured(answer),
            **effects(heard),
            "damaged": _damage(answer, query),
        }


def _asked(query: Query | None) -> dict[str, Any]:
    if query is None:
        return dict.fromkeys((*_ASKED, "question", "asked", "leased", "policy_gradient_steps"))
    return {
        **{name: sound(query, name) for name in _ASKED},
        "question": sound(query, "public_id"),
        "asked": iso_time(sound(query, "posted")),
        "leased": iso_time(sound(query, "leased")),
        "policy_gradient_steps": sound(query, "policy_steps"),
    }


def _damage(answer: Answer, query: Query | None) -> str | None:
    asked = "its question is missing" if query is None else damage(query)
    return "; ".join(filter(None, (damage(answer), asked))) or None


def _numbers(session: Session, answers: Sequence[Answer]) -> dict[Any, int]:
    """Return the numbers of what these answers supersede, by their rows."""
    rows = {one for answer in answers if (one := sound(answer, "supersedes")) is not None}
    found = session.execute(select(Answer.id, Answer.number).where(Answer.id.in_(rows))) if rows else ()
    return {row[0]: row[1] for row in found}


def _superseding(session: Session, rows: Sequence[int]) -> dict[int, int]:
    found = session.execute(select(Answer.supersedes, Answer.number).where(Answer.supersedes.in_(rows)))
    return {row: number for row, number in found if row is not None}


def _last_heard(session: Session, questions: Sequence[int]) -> dict[int, int]:
    """Return the tick at which the agent last heard an answer to each question."""
    last = func.max(Answer.applied_tick)
    wanted = select(Answer.query_id, last).where(Answer.query_id.in_(questions)).group_by(Answer.query_id)
    return {row[0]: row[1] for row in session.execute(wanted) if row[1] is not None}


def _effects(session: Session, run_id: int, answers: Sequence[Answer]) -> Any:
    heard = [tick for answer in answers if (tick := sound(answer, "applied_tick")) is not None]
    rows = session.scalars(select(Effect).where(Effect.run_id == run_id, Effect.tick.in_(heard)))
    known = {(row.tick, row.ticks): row.policy["probabilities"] for row in rows if damage(row) is None}

    def columns(tick: int | None) -> dict[str, Any]:
        return dict(_flat(known, tick))

    return columns


def _flat(known: dict[tuple[int, int], Sequence[float]], tick: int | None) -> Iterator[tuple[str, Any]]:
    for name, ticks in zip(EFFECTS, TICKS, strict=True):
        there = known.get((tick, ticks)) if tick is not None else None
        for place, move in enumerate(MOVES):
            yield f"{name}_{move}", None if there is None else there[place]

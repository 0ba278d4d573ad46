"""The reason for a question, and what its answers changed, as stored by the worker (`server.why`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from sqlalchemy import select

from parenting.server.damage import damage, readable
from parenting.server.db import Database
from parenting.server.queue.answers import get_query
from parenting.server.queue.presence import holder
from parenting.server.runs import get_run
from parenting.server.schemas import Chances, PolicySchema
from parenting.server.tables import SKIP, Answer, Effect, Query, Reason
from parenting.server.why_schemas import (
    EffectSchema,
    GivenSchema,
    GuidanceReason,
    PolicyThere,
    PreferenceReason,
    WhySchema,
)

TICKS = (0, 1, 10, 100)
"""The ticks after an answer at which the policy is known; 0: before it."""


def why(db: Database, query_id: int) -> WhySchema:
    """Return the reason for a question and the effects of its answers.

    Raises:
        NotFound: there is no such question.
        DamagedRowError: a row of it cannot be read.
    """
    query = readable(get_query(db, query_id))
    with db.read() as session:
        reason = session.get(Reason, (query.run_id, query.tick))
        given = session.scalars(
            select(Answer).where(Answer.query_id == query.id).order_by(Answer.number)
        ).all()
        heard = [answer.applied_tick for answer in given]
        effects = session.scalars(
            select(Effect).where(Effect.run_id == query.run_id, Effect.tick.in_(heard))
        ).all()
    stored = None if reason is None else readable(reason).why
    known = {(row.tick, row.ticks): PolicyThere.model_validate(readable(row).policy) for row in effects}
    names = ("public_id", "kind", "tick", "votes", "status", "posted", "leased")
    return WhySchema(
        **{name: getattr(query, name) for name in names},
        run_public_id=get_run(db, query.run_id).public_id,
        policy=PolicySchema(stage=query.policy_stage, gradient_steps=query.policy_steps),
        guidance=None
        if stored is None or query.kind != "guidance"
        else GuidanceReason.model_validate(stored),
        preference=None
        if stored is None or query.kind != "preference"
        else PreferenceReason.model_validate(stored),
        answers=[_given(readable(answer), known) for answer in given],
    )


class Kept(NamedTuple):
    """The reasons of some questions by tick, and the effects of some answers by tick and ticks since."""

    reasons: dict[int, dict[str, Any]]
    effects: dict[tuple[int, int], Chances]

    def effects_of(self, heard: int | None) -> dict[str, Chances | None] | None:
        """Return the policy before an answer and after it; None where nothing of it was kept."""
        found = {} if heard is None else {n: self.effects.get((heard, n)) for n in TICKS}
        if not any(found.values()):
            return None
        return {"before" if n == 0 else f"after_{n}": there for n, there in found.items()}


def kept(db: Database, run_id: int, asked: Sequence[int], heard: Sequence[int]) -> Kept:
    """Return what is kept of a run's questions and answers of these ticks; a damaged row counts as absent."""
    with db.read() as session:
        reasons = session.scalars(select(Reason).where(Reason.run_id == run_id, Reason.tick.in_(asked))).all()
        effects = session.scalars(select(Effect).where(Effect.run_id == run_id, Effect.tick.in_(heard))).all()
    there = {row: PolicyThere.model_validate(row.policy) for row in effects if damage(row) is None}
    return Kept(
        {row.tick: row.why for row in reasons if damage(row) is None},
        {(row.tick, row.ticks): policy.probabilities for row, policy in there.items()},
    )


def last_question(db: Database, run_id: int) -> Query | None:
    """Return the question of a run that was asked last; None if it has asked nothing yet."""
    rows = select(Query).where(Query.run_id == run_id).order_by(Query.tick.desc()).limit(1)
    with db.read() as session:
        return session.scalars(rows).first()


def neighbours(db: Database, query: Query) -> tuple[str | None, str | None]:
    """Return the public ids of the questions before and after one of the same run."""
    ids = select(Query.public_id).where(Query.run_id == query.run_id).limit(1)
    with db.read() as session:
        before = session.scalars(ids.where(Query.tick < query.tick).order_by(Query.tick.desc())).first()
        after = session.scalars(ids.where(Query.tick > query.tick).order_by(Query.tick)).first()
    return before, after


def _given(answer: Answer, known: dict[tuple[int, int], PolicyThere]) -> GivenSchema:
    names = ("number", "choice", "parent", "received", "applied_tick", "standing", "replays", "measured")
    heard = answer.applied_tick
    effects = []
    if heard is not None and answer.choice != SKIP:
        found = [known.get((heard, ticks)) for ticks in TICKS]
        effects = [
            EffectSchema(ticks=ticks, probabilities=None if one is None else one.probabilities)
            for ticks, one in zip(TICKS, found, strict=True)
        ]
    return GivenSchema(
        **{name: getattr(answer, name) for name in names}, who=holder(answer.client_id), effects=effects
    )

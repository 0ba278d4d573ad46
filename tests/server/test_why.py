"""The reasons of questions and the effects of answers, as the worker stores them."""

from __future__ import annotations

from typing import Any

import pytest
from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim
from parenting.server.session import RunSession
from parenting.server.tables import Answer, Effect, Query, Reason

pytestmark = pytest.mark.only("sqlite", "what the worker stores is JSON to every store")

CONFIG: dict[str, bool | int | float | str | None] = {
    "stages": 2,
    "mature_every": 30,
    "p_pref": 0.3,
    "pretrain": False,
}


def live(life: RunSession, ticks: int) -> None:
    for _ in range(ticks):
        life.tick(watch(life.db, [life.claim.run_id])[life.claim.run_id])


def stored(db: Database, run_id: int) -> tuple[dict[int, Any], dict[tuple[int, int], Any]]:
    with db.read() as session:
        reasons = session.scalars(select(Reason).where(Reason.run_id == run_id)).all()
        effects = session.scalars(select(Effect).where(Effect.run_id == run_id)).all()
    return {row.tick: row.why for row in reasons}, {(row.tick, row.ticks): row.policy for row in effects}


def test_a_killed_worker_repeats_the_same_reasons_and_effects(db: Database) -> None:
    run = start(db, NewRun(world="reward-hacking", parent="scripted", seed=3, config=CONFIG))
    (mine,) = claim(db, "test")
    life = RunSession(db, mine, run, lambda: None)
    live(life, 40)
    life.save()
    live(life, 20)  # of these nothing is written
    again = RunSession(db, mine, run, lambda: None)
    assert again.last_tick == 40
    live(again, 90)
    again.why.write()
    other = start(db, NewRun(world="reward-hacking", parent="scripted", seed=3, config=CONFIG))
    (theirs,) = claim(db, "test")
    whole = RunSession(db, theirs, other, lambda: None)
    live(whole, 130)
    whole.why.write()
    assert stored(db, run.id) == stored(db, other.id)
    reasons, effects = stored(db, run.id)
    with db.read() as session:
        asked = {row.tick: row.kind for row in session.scalars(select(Query).where(Query.run_id == run.id))}
        heard = session.scalars(select(Answer.applied_tick).where(Answer.run_id == run.id)).all()
    assert set(reasons) == set(asked)
    assert {"guidance", "preference"} == set(asked.values())
    ticks = {tick for tick in heard if tick is not None}
    assert set(effects) == {(h, n) for h in ticks for n in (0, 1, 10, 100) if h + n - 1 <= 130}

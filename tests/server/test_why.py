"""The reasons of questions and the effects of answers, as the worker stores them."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
from sqlalchemy import select

from parenting.drawing.query_tensors import ACTIONS
from parenting.server.db import Database
from parenting.server.moves import WAY, read_moves
from parenting.server.new_run import NewRun, start
from parenting.server.queue import answers, revisions
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim
from parenting.server.session import RunSession
from parenting.server.tables import Answer, Effect, Query, Reason

pytestmark = pytest.mark.only("sqlite", "what the worker stores is JSON to every store")

CONFIG: dict[str, bool | int | float | str | None] = {
    "stages": 2,
    "mature_every": 20,
    "p_guid": 0.3,
    "p_pref": 0.9,
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


def begun(db: Database, **fields: Any) -> RunSession:
    run = start(db, NewRun(world="unsafe-exploration", seed=3, config=CONFIG, **fields))
    mine = next(one for one in claim(db, "test") if one.run_id == run.id)
    return RunSession(db, mine, run, lambda: None)


def questions(db: Database, run_id: int) -> dict[int, Query]:
    asked = select(Query).where(Query.run_id == run_id).order_by(Query.tick)
    with db.read() as session:
        return {row.tick: row for row in session.scalars(asked)}


@pytest.mark.slow
def test_a_killed_worker_writes_the_same_reasons_and_effects(db: Database) -> None:
    """Also those that were due when it was killed, of answers from before its checkpoint."""
    life = begun(db, parent="scripted")
    live(life, 25)
    life.save()
    live(life, 10)  # of these nothing is written
    again = RunSession(db, life.claim, life.run, lambda: None)
    assert again.last_tick == 25
    live(again, 85)
    again.save()
    whole = begun(db, parent="scripted")
    live(whole, 110)
    whole.save()
    found = stored(db, life.claim.run_id)
    assert found == stored(db, whole.claim.run_id)
    reasons, effects = found
    assert set(reasons) == set(questions(db, life.claim.run_id))
    with db.read() as session:
        rows = session.scalars(select(Answer.applied_tick).where(Answer.run_id == life.claim.run_id))
        heard = {tick for tick in rows if tick is not None}
    assert set(effects) == {(tick, n) for tick in heard for n in (0, 1, 10, 100) if tick + n - 1 <= 110}
    assert effects[min(heard), 0] != effects[min(heard), 100]


def test_reasons_agree_with_the_record(db: Database) -> None:
    """Familiarity is counted again from the questions, and clips are found among the moves of the life."""
    life = begun(db, parent="scripted")
    live(life, 60)
    life.save()
    reasons, moves = stored(db, life.claim.run_id)[0], read_moves(db, life.claim.run_id)
    asked_in: Counter[tuple[str, ...]] = Counter()
    kinds = Counter[str]()
    for tick, query in questions(db, life.claim.run_id).items():
        why = reasons[tick]
        kinds[query.kind] += 1
        if query.kind == "guidance":
            near = surroundings(query.clips["left"]["frames"][0])
            assert (why["familiarity"], why["p_guid"]) == (asked_in[near], life.saved.config.p_guid)
            assert why["draw"] < why["chance"] == pytest.approx(why["p_guid"] ** why["familiarity"])
            asked_in[near] += 1
            continue
        assert why["draw"] < why["p_pref"] == CONFIG["p_pref"]
        assert {one["kind"] for one in why["clips"].values()} == {"exploitative", "exploratory"}
        for side, recording in why["clips"].items():
            assert recording["last"] <= tick
            lived = moves[recording["first"] - 1 : recording["last"]]
            assert [ACTIONS[move & WAY] for move in lived] == query.clips[side]["actions"]
    assert min(kinds["guidance"], kinds["preference"]) > 4


def surroundings(frame: dict[str, Any]) -> tuple[str, ...]:
    """The four cells beside the agent, as it saw them; beyond the board there are walls."""
    (row, column), rows = frame["agent"], frame["observed"]
    beside = ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1))
    within = [0 <= r < len(rows) and 0 <= c < len(rows[0]) for r, c in beside]
    return tuple(rows[r][c] if inside else "#" for (r, c), inside in zip(beside, within, strict=True))


def test_a_pause_that_goes_on_has_no_draw_and_a_correction_has_effects_of_its_own(db: Database) -> None:
    life = begun(db)
    run_id = life.claim.run_id
    live(life, 1)
    first = questions(db, run_id)[1]
    answers.answer(db, first.id, "neither", "me", "human")
    live(life, 1)
    second = questions(db, run_id)[2]
    answers.answer(db, second.id, "left", "me", "human")
    live(life, 1)
    revisions.supersede(db, second.id, "right", "me", "human")
    live(life, 1)
    life.why.write()
    reasons, effects = stored(db, run_id)
    assert [(reasons[tick]["pausing"], reasons[tick]["familiarity"]) for tick in (1, 2)] == [
        (True, 0),
        (False, 1),
    ]
    assert {(2, 0), (2, 1), (3, 0), (3, 1), (4, 0), (4, 1)} == set(effects)
    with db.read() as session:
        heard = session.scalars(select(Answer.applied_tick).where(Answer.query_id == second.id)).all()
    assert sorted(tick or 0 for tick in heard) == [3, 4]

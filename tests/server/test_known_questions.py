"""Questions that a worker has in tensors: it hears an answer to one as if it had read it from its row."""

from __future__ import annotations

from collections import Counter

import pytest
from sqlalchemy import inspect, select

from parenting.agent.query import Answer, empty
from parenting.server import tables
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue import answers
from parenting.server.queue.known import MOST, Known
from parenting.server.queue.queue_parent import QueueParent
from parenting.server.queue.worker_side import post_query, take_answer, watch
from parenting.server.runs import Claim, claim
from parenting.server.session import RunSession
from tests.server.conftest import CLIPS

CONFIG: dict[str, bool | int | float | str | None] = {
    "stages": 2,
    "mature_every": 20,
    "p_guid": 0.3,
    "p_pref": 0.9,
    "pretrain": False,
}


def begun(db: Database) -> RunSession:
    """A run whose parent the test is."""
    run = start(db, NewRun(world="unsafe-exploration", seed=3, config=CONFIG))
    mine = next(one for one in claim(db, "test") if one.run_id == run.id)
    return RunSession(db, mine, run, lambda: None)


def live(life: RunSession, ticks: int) -> None:
    """Live, and answer every question at once: of two moves the one on the left."""
    for _ in range(ticks):
        life.tick(watch(life.db, [life.claim.run_id])[life.claim.run_id])
        for number in opened(life.db):
            answers.answer(life.db, number, "left", "me", "human")


def opened(db: Database) -> list[int]:
    with db.read() as session:
        return list(session.scalars(select(tables.Query.id).where(tables.Query.status == "open")))


@pytest.mark.only("sqlite", "what a worker keeps in memory is the same beside every store")
def test_a_known_question_is_heard_as_its_row_has_it(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    kinds, read, usual = Counter[str](), QueueParent.read, QueueParent.in_tensors

    def heard(parent: QueueParent, row: tables.Answer, query: tables.Query) -> Answer:
        said = usual(parent, row, query)
        with db.read() as session:
            expected = read(parent, session.get_one(tables.Query, query.id))
        for (name, here, _), (_, there, _) in zip(said.query.leaves(), expected.leaves(), strict=True):
            assert (here.dtype, here.shape) == (there.dtype, there.shape), name
            assert here.tolist() == there.tolist(), name
        kinds[query.kind] += 1
        return said

    def refused(_parent: QueueParent, row: tables.Query) -> None:
        raise AssertionError(f"question {row.id} is read from its row")

    life = begun(db)
    monkeypatch.setattr(QueueParent, "in_tensors", heard)
    monkeypatch.setattr(QueueParent, "read", refused)
    live(life, 80)
    assert min(kinds["guidance"], kinds["preference"]) > 4


@pytest.mark.slow
@pytest.mark.only("sqlite", "what a worker keeps in memory is the same beside every store")
def test_a_worker_that_knows_nothing_reads_the_question(db: Database) -> None:
    life = begun(db)
    live(life, 3)
    life.save()
    later = RunSession(db, life.claim, life.run, lambda: None)
    assert not later.parent.known.numbers()
    live(later, 20)
    whole = begun(db)
    live(whole, 23)
    for (name, here, _), (_, there, _) in zip(
        later.saved.state.x.leaves(), whole.saved.state.x.leaves(), strict=True
    ):
        assert here.tolist() == there.tolist(), name
    assert later.saved.state.x.size.tolist() > [3]


def test_clips_of_a_known_question_alone_are_left_out(db: Database, mine: Claim) -> None:
    first, second = (post_query(db, mine, tick, "preference", 1, CLIPS) for tick in (1, 2))
    for number in (first, second):
        answers.answer(db, number, "left", "a", "human")
    known, read = (take_answer(db, mine, tick, known=[first]) for tick in (3, 4))
    assert known is not None
    assert read is not None
    assert (known.query.id, inspect(known.query).unloaded) == (first, {"clips"})
    assert (read.query.id, read.query.clips) == (second, CLIPS)


def test_the_oldest_question_makes_room() -> None:
    known, asked = Known(), empty(1, 1, 2, 2)
    for number in range(MOST + 1):
        known.keep(number, asked)
    assert list(known.numbers()) == list(range(1, MOST + 1))
    assert known.forget(0) is None
    assert known.forget(2) is asked
    assert known.forget(2) is None

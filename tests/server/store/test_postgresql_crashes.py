"""A worker forgets only what PostgreSQL has on its disk: the server may crash alone, without the worker."""

import pytest
from sqlalchemy import event

from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import answer
from parenting.server.queue.corrections import take_correction
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import take_answer, watch
from parenting.server.runs import Claim, claim
from parenting.server.session import RunSession

pytestmark = pytest.mark.only("postgresql", "SQLite ends with its processes alone")


def committing(db: Database) -> list[object]:
    """A list to which each commit adds whether it waits for the log."""
    found: list[object] = []
    event.listen(
        db.engine,
        "commit",
        lambda connection: found.append(connection.exec_driver_sql("SHOW synchronous_commit").scalar()),
    )
    return found


def test_an_answer_that_was_heard_is_heard_after_a_crash_of_the_server(
    db: Database, mine: Claim, guidance: int
) -> None:
    """The worker lives through it: it would hear the answer a second time."""
    answer(db, guidance, "left", "a", "human")
    found = committing(db)
    assert take_answer(db, mine, 9) is not None
    assert found == ["on"]


def test_a_correction_that_was_heard_is_heard_after_a_crash_of_the_server(
    db: Database, mine: Claim, guidance: int
) -> None:
    answer(db, guidance, "left", "a", "human")
    take_answer(db, mine, 9)
    supersede(db, guidance, "right", "a", "human")
    found = committing(db)
    assert take_correction(db, mine, 10) is not None
    assert found == ["on"]


def test_what_a_worker_forgets_once_it_is_stored_is_there_after_a_crash_of_the_server(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.why.WRITE_SECONDS", 1e9)  # a slow tick would write at its end
    run = start(db, NewRun(world="unsafe-exploration"))
    life = RunSession(db, next(one for one in claim(db, "me") if one.run_id == run.id), run, lambda: None)
    life.tick(watch(db, [run.id])[run.id])
    found = committing(db)
    life.lived.write()
    life.why.write()
    assert found == ["on", "on"]

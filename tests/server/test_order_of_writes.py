"""The order of writes after an answer: the next question comes first, then all for which nobody waits."""

from typing import Any

import pytest
from sqlalchemy import event

from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim
from parenting.server.session import RunSession

pytestmark = pytest.mark.only("sqlite", "the worker decides the order, not the store")


def test_metrics_come_after_the_next_question(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where it is some ticks away, and the last row of metrics is old."""
    monkeypatch.setattr("parenting.server.session.HURRY_SECONDS", 60.0)  # however slow this machine is
    monkeypatch.setattr("parenting.server.session.METRIC_SECONDS", 0.0)
    config: dict[str, Any] = {"p_guid": 0.9, "p_pref": 0.0}
    run = start(db, NewRun(world="unsafe-exploration", parent="human", seed=3, config=config))
    (mine,) = claim(db, "test")
    life, written = RunSession(db, mine, run, lambda: None), list[str]()

    def executed(_connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        table = statement.removeprefix("INSERT INTO ").partition(" ")[0].strip('"')
        if statement.startswith("INSERT") and table in ("query", "metric"):
            written.append(table)

    def to_the_question() -> None:
        while not watch(db, [run.id])[run.id].open_guidance:
            life.tick(watch(db, [run.id])[run.id])

    to_the_question()
    event.listen(db.engine, "before_cursor_execute", executed)
    walked = False
    for _ in range(20):
        written.clear()
        found, before = lease(db, run.id, "me"), life.last_tick
        assert found is not None
        answer(db, found.id, "either", "me", "human")
        to_the_question()
        walked = walked or life.last_tick > before + 1
        assert written == ["query", "metric"]
    assert walked, "each answer was followed by a question at once: that shows too little"

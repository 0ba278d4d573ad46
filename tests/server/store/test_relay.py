"""On PostgreSQL a process on another machine, which shares no data folder, hears of answers and questions."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from sqlalchemy import text

from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.operator_events import add_operator_event
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.store.relay import Channel, Relay
from tests.server.conftest import CLIPS

SECONDS = 30
"""Longer than anything takes here."""


class Heard(threading.Event):
    """An event that is set once something new is heard, and what was told."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[str] = []

    def hear(self, word: str) -> None:
        """Hear a word."""
        self.told.append(word)
        self.set()


@contextmanager
def elsewhere(db: Database, channel: Channel) -> Iterator[Heard]:
    """A process on another machine."""
    heard = Heard()
    relay = Relay(db.engine, channel, heard.hear)
    relay.start()
    assert heard.wait(SECONDS), "it listens"
    heard.clear()
    yield heard
    relay.close()


@pytest.mark.only("postgresql", "SQLite has one machine")
def test_an_answer_is_heard_on_every_machine(db: Database, guidance: int) -> None:
    with elsewhere(db, "worker") as one, elsewhere(db, "worker") as other, elsewhere(db, "web") as web:
        answer(db, guidance, "left", "a", "human")
        assert one.wait(SECONDS)
        assert other.wait(SECONDS)
        assert not web.is_set()


@pytest.mark.only("postgresql", "SQLite has one machine")
def test_events_are_heard_by_workers_and_questions_by_the_web(db: Database, mine: Claim) -> None:
    with elsewhere(db, "worker") as worker, elsewhere(db, "web") as web:
        add_operator_event(db, mine.run_id, "end_episode", {"kind": "end_episode"})
        assert worker.wait(SECONDS)
        assert not web.is_set()
        post_query(db, mine, 7, "preference", 1, CLIPS)
        assert web.wait(SECONDS)
        assert web.told == ["", str(mine.run_id)], "it listens, and this run has news"


@pytest.mark.only("postgresql", "SQLite has one machine")
def test_what_was_not_stored_is_not_heard(db: Database, guidance: int) -> None:
    answer(db, guidance, "left", "a", "human")
    with elsewhere(db, "worker") as heard:
        with pytest.raises(Conflict):
            answer(db, guidance, "right", "a", "human")
        assert not heard.wait(0.1)


@pytest.mark.only("postgresql", "SQLite has one machine")
def test_a_connection_that_was_lost_is_made_again(
    db: Database, guidance: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.store.relay.AGAIN_SECONDS", 0.01)
    with elsewhere(db, "worker") as heard:
        with db.write() as session:
            others = "pid != pg_backend_pid() AND query LIKE 'LISTEN%' AND datname = current_database()"
            cut = f"SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity WHERE {others}"
            assert session.execute(text(cut)).scalar_one() == 1
        assert heard.wait(SECONDS), "it listens again"
        heard.clear()
        answer(db, guidance, "left", "a", "human")
        assert heard.wait(SECONDS)


@pytest.mark.only("sqlite", "PostgreSQL is heard, see above")
def test_sqlite_has_nobody_else_to_tell(db: Database, guidance: int, tmp_path: Path) -> None:
    relay = Relay(db.engine, "worker", lambda run: pytest.fail("it was called"))
    relay.start()
    answer(db, guidance, "left", "a", "human")
    relay.close()

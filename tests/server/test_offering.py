"""The offers of a run to those who wait for its next question, and the readers whom the watcher wakes."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

import pytest
from sqlalchemy import event

from parenting.server.admission import Admission
from parenting.server.db import Database
from parenting.server.errors import BusyError
from parenting.server.new_run import NewRun, start
from parenting.server.notify import Notifier
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease, release
from parenting.server.queue.worker_side import post_query
from parenting.server.reads.offering import Offer
from parenting.server.reads.watching import Look, look
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from parenting.server.streams import LONGEST_REST, Streams
from parenting.server.subscriptions import Subscription
from parenting.server.tables import Run
from tests.server.conftest import CLIPS, Clock


def offered(db: Database, run: int) -> Offer:
    return look(db, [], [run]).offers[run]


def test_held_questions_are_not_free_until_their_lease_ends(
    db: Database, clock: Clock, mine: Claim, guidance: int
) -> None:
    asked = offered(db, mine.run_id)
    assert asked.free == 1
    assert lease(db, mine.run_id, "a", seconds=60) is not None
    held = offered(db, mine.run_id)
    assert held.free == 0
    assert held != asked
    clock.pass_seconds(61)
    assert offered(db, mine.run_id).free == 1
    lease(db, mine.run_id, "b")
    release(db, guidance, "b")
    assert offered(db, mine.run_id) == asked
    answer(db, guidance, "left", "a", "human")
    assert offered(db, mine.run_id).free == 0


def test_any_number_of_runs_takes_one_statement(db: Database, mine: Claim, guidance: int) -> None:
    others = [start(db, NewRun(world="unsafe-exploration")).id for _ in range(3)]
    said: list[str] = []
    event.listen(db.engine, "before_cursor_execute", lambda *words: said.append(words[2]))
    found = look(db, [], [mine.run_id, *others, 99]).offers
    assert [found[run].free for run in (mine.run_id, *others)] == [1, 0, 0, 0]
    assert 99 not in found
    assert len([words for words in said if "FROM run" in words]) == 1


def test_a_look_knows_when_the_first_lease_ends(db: Database, mine: Claim) -> None:
    assert look(db, [], [mine.run_id]).ends == float("inf")
    for tick, seconds in ((1, 500.0), (2, 200.0)):
        post_query(db, mine, tick, "preference", 1, CLIPS)
        lease(db, mine.run_id, f"client-{tick}", seconds)
    soon = look(db, [], [mine.run_id])
    assert soon.ends == pytest.approx(look(db, [mine.run_id]).ends, abs=60)


def test_a_question_wakes_who_waits_and_its_lease_does_not() -> None:
    one, woken = Subscription(), list[bool]()
    for state, free in (((1,), 0), ((1,), 1), ((1,), 1), ((2,), 0), ((3,), 0), ((4,), 2)):
        before = one.offered
        one.take_offer(Offer(state, free))
        woken.append(before.is_set())
    assert woken == [False, True, False, False, False, True]


def test_a_run_that_is_deleted_ends_the_wait() -> None:
    one = Subscription()
    before = one.offered
    one.take_offer(None)
    assert one.gone
    assert before.is_set()


class Waiting:
    """Somebody who waits for a question of a run while it is posted, and how it was looked for."""

    def __init__(self, settings: Settings, db: Database, mine: Claim) -> None:
        self.db, self.mine, self.looked = db, mine, list[str]()
        self.streams = Streams(db, Notifier(settings.data, "web"), 2, Admission())

    async def look(self, name: str) -> Any:
        """Look for it, in one of two ways."""
        self.looked.append(name)
        return await asyncio.to_thread(lease, self.db, self.mine.run_id, "a")

    async def is_gone(self) -> bool:
        """Return that somebody is still there."""
        return False

    async def wait(self, then: Callable[[], Awaitable[None]]) -> Any:
        """Wait, post a question once the watcher has looked, do something, and return what is found."""
        streams, run_id = self.streams, self.mine.run_id
        streams.open()
        ways = partial(self.look, "look"), partial(self.look, "sure")
        waits = asyncio.ensure_future(streams.wait_for(run_id, ways[0], 10, self.is_gone, ways[1]))
        while not streams.subscriptions or streams.subscriptions[run_id].offers is None:
            await asyncio.sleep(0.01)
        await asyncio.to_thread(post_query, self.db, self.mine, 1, "guidance", 1, CLIPS)
        await then()
        found = await waits
        streams.end()
        assert self.looked == ["look", "sure"], (
            "one look when they come; after the offer none that only reads"
        )
        return found


@pytest.fixture
def somebody(settings: Settings, db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch) -> Waiting:
    monkeypatch.setattr("parenting.server.streams.AGAIN_SECONDS", 3600)
    return Waiting(settings, db, mine)


def test_who_waits_alone_takes_the_question_at_once(somebody: Waiting) -> None:
    async def nothing() -> None:
        pass

    assert asyncio.run(somebody.wait(nothing)).run_id == somebody.mine.run_id


@pytest.mark.only(
    "sqlite", "PostgreSQL notifies by the commit itself, as tests/server/store/test_relay.py sees"
)
def test_a_notification_of_a_run_brings_its_question_without_a_look_of_the_watcher(
    settings: Settings, somebody: Waiting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The watcher is asleep for an hour; a notification of another run wakes nobody."""
    monkeypatch.setattr("parenting.server.streams.POLL_SECONDS", 3600)
    worker, run_id = Notifier(settings.data, "web"), somebody.mine.run_id

    async def notify() -> None:
        worker.notify(run_id + 1)
        await asyncio.sleep(0.2)
        assert somebody.looked == ["look"]
        worker.notify(run_id)

    assert asyncio.run(somebody.wait(notify)).run_id == run_id


def test_followed_runs_and_asked_ones_are_looked_at_together(
    db: Database, run: Run, mine: Claim, guidance: int
) -> None:
    other = start(db, NewRun(world="unsafe-exploration")).id
    found: Look = look(db, [run.id], [other])
    assert (list(found.runs), list(found.offers)) == ([run.id], [other])


@pytest.mark.only("sqlite", "the watcher alone")
def test_the_watcher_rests_where_the_store_refuses(
    settings: Settings, db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lease has ended, so it has something to look at, again and again."""
    streams, looks = Streams(db, Notifier(settings.data, "web"), 2, Admission()), list[float]()

    async def refused() -> float:
        looks.append(time.monotonic())
        raise BusyError

    async def watch() -> None:
        streams.open()
        with streams.joined(mine.run_id):
            await asyncio.sleep(0.5)
        streams.end()

    monkeypatch.setattr(streams, "_look", refused)
    monkeypatch.setattr(streams, "_ends", 0.0)
    asyncio.run(watch())
    assert 2 <= len(looks) <= (looks[-1] - looks[0]) / LONGEST_REST + 2

"""Live streams through a real server: what is told, how soon, how often."""

import asyncio
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import httpx2
import pytest
import uvicorn
from sqlalchemy import event

from parenting.server.admission import Admission
from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.new_run import NewRun, start
from parenting.server.notify import Notifier
from parenting.server.progress import report_progress
from parenting.server.queue.answers import answer, get_query
from parenting.server.queue.leases import lease
from parenting.server.queue.presence import holder, leave
from parenting.server.queue.worker_side import post_query
from parenting.server.reads.watching import look, told_runs
from parenting.server.runs import Claim, claim
from parenting.server.settings import Settings
from parenting.server.streams import POLL_SECONDS, Streams
from parenting.server.tables import Run
from tests.database import migrated
from tests.server.conftest import CLIPS
from tests.server.serving import Stream, until_up


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    """With the real clock: the server of these tests is real too."""
    database = migrated(settings)
    yield database
    database.close()


@pytest.fixture
def url(settings: Settings, db: Database) -> Iterator[str]:
    """A server in a thread, with room for two streams."""
    listener = socket.create_server(("127.0.0.1", 0))
    app = create_app(settings.model_copy(update={"streams": 2}))
    server = uvicorn.Server(uvicorn.Config(app, log_config=None, timeout_graceful_shutdown=1))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    base = f"http://127.0.0.1:{listener.getsockname()[1]}"
    until_up(base)
    yield base
    app.state.streams.close()
    server.should_exit = True
    thread.join(10)
    assert not thread.is_alive()


def told(db: Database, query: int) -> dict[str, object]:
    """A question as the stream tells of it."""
    row = get_query(db, query)
    return {"id": query, "public_id": row.public_id, "kind": row.kind}


def follow(url: str, mine: Claim, query: str = "") -> Stream:
    stream = Stream(f"{url}/api/v1/runs/{mine.run_id}/events{query}")
    assert stream.opened.wait(10)
    return stream


def test_stream_begins_with_where_things_are(url: str, db: Database, mine: Claim, guidance: int) -> None:
    stream = follow(url, mine)
    assert stream.headers["content-type"].startswith("text/event-stream")
    (run,) = stream.wait_for("run")
    assert isinstance(run, dict)
    assert (run["status"], run["open"]["guidance"]) == ("active", 1)
    assert stream.wait_for("question") == [told(db, guidance)]


def test_question_is_told_when_the_bell_rings(
    url: str, settings: Settings, db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is polled meanwhile."""
    monkeypatch.setattr("parenting.server.streams.POLL_SECONDS", 3600)
    stream = follow(url, mine)
    assert stream.wait_for("question") == [None]
    notifier = Notifier(settings.data, "web")
    for tick in range(5):
        query = post_query(db, mine, tick, "guidance", 1, CLIPS)
        notifier.notify()
        assert stream.wait_for("question", 2 * tick + 2)[-1] == told(db, query)
        answer(db, query, "left", "a", "human")
        notifier.notify()
        assert stream.wait_for("question", 2 * tick + 3)[-1] is None


def test_question_is_told_without_any_bell(url: str, db: Database, mine: Claim) -> None:
    stream = follow(url, mine)
    stream.wait_for("question")
    query = post_query(db, mine, 1, "preference", 1, CLIPS)
    assert stream.wait_for("question", 2)[-1] == told(db, query)


def test_the_end_of_a_lease_is_told_without_any_bell(
    url: str, settings: Settings, db: Database, mine: Claim, guidance: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is written and nothing is polled meanwhile: the stream itself wakes then."""
    monkeypatch.setattr("parenting.server.streams.POLL_SECONDS", 3600)
    lease(db, mine.run_id, "a")
    stream = follow(url, mine)
    name = get_query(db, guidance).public_id
    assert stream.wait_for("leases") == [[{"question": name, "holder": holder("a")}]]
    leave(db, mine.run_id, "a", 0.5)
    Notifier(settings.data, "web").notify()
    assert stream.wait_for("leases", 2)[1] == []


def test_the_rest_is_told_four_times_a_second(
    url: str, settings: Settings, db: Database, mine: Claim
) -> None:
    stream, notifier = follow(url, mine), Notifier(settings.data, "web")
    began = time.monotonic()
    stream.wait_for("run")
    for tick in range(60):
        report_progress(db, mine, tick=tick)
        notifier.notify()
        time.sleep(0.02)
    told = stream.wait_for("run", 4)
    assert len(told) <= (time.monotonic() - began) / POLL_SECONDS + 2
    end = time.monotonic() + 10
    while stream.wait_for("run")[-1]["tick"] != 59:
        assert time.monotonic() < end, "the last state is told in the end"
        time.sleep(0.05)


def test_metrics_follow_a_tick(url: str, db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {1: {"loss": 0.5}, 2: {"loss": 0.25}})
    stream = follow(url, mine, "?after=1")
    assert stream.wait_for("metrics") == [{"rows": [{"tick": 2, "values": {"loss": 0.25}}]}]
    write_metrics(db, mine, {3: {"loss": None}})
    report_progress(db, mine, tick=3)
    assert stream.wait_for("metrics", 2)[1] == {"rows": [{"tick": 3, "values": {"loss": None}}]}


def test_metrics_of_a_long_life_come_in_parts(
    url: str, db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.reads.watching.ROWS", 2)
    write_metrics(db, mine, {tick: {"loss": 0.5} for tick in range(5)})
    told = follow(url, mine, "?after=-1").wait_for("metrics", 3)
    assert [[row["tick"] for row in part["rows"]] for part in told] == [[0, 1], [2, 3], [4]]


def test_parents_page_is_spared_the_metrics(url: str, db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {1: {"loss": 0.5}})
    stream = follow(url, mine)
    stream.wait_for("run")
    report_progress(db, mine, tick=1)
    stream.wait_for("run", 2)
    assert "metrics" not in {name for name, _ in stream.events}


def test_one_stream_too_many_is_refused(url: str, mine: Claim) -> None:
    for _ in range(2):
        follow(url, mine).wait_for("run")
    with httpx2.stream("GET", f"{url}/api/v1/runs/{mine.run_id}/events") as refused:
        assert refused.status_code == 503  # a stream that is not refused has no end to wait for
        assert json.loads(refused.read())["error"]["code"] == "too_many"


def test_many_runs_are_looked_at_by_as_many_statements_as_one(db: Database, run: Run) -> None:
    others = [start(db, NewRun(world="unsafe-exploration")).id for _ in range(5)]
    said: list[str] = []
    event.listen(db.engine, "before_cursor_execute", lambda *words: said.append(words[2]))
    assert sorted(look(db, [run.id]).runs) == [run.id]
    one = len(said)
    assert sorted(look(db, [run.id, *others]).runs) == [run.id, *others]
    assert len(said) == 2 * one


def test_a_run_is_read_once_for_all_of_its_streams(
    url: str, db: Database, settings: Settings, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[Sequence[int]] = []

    def noted(db: Database, runs: Sequence[int]) -> dict[int, str]:
        read.append(runs)
        return told_runs(db, runs)

    monkeypatch.setattr("parenting.server.streams.told_runs", noted)
    streams = [follow(url, mine) for _ in range(2)]
    for stream in streams:
        stream.wait_for("run")
    before = len(read)
    report_progress(db, mine, tick=9)
    Notifier(settings.data, "web").notify()
    for stream in streams:
        assert stream.wait_for("run", 2)[1]["tick"] == 9
    assert len(read) == before + 1


def test_who_waits_for_a_question_of_one_run_does_not_look_when_another_asks(
    settings: Settings, db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The notification is the same; what the watcher saw decides."""
    start(db, NewRun(world="unsafe-exploration"))
    (other,) = claim(db, "worker-1")
    streams = Streams(db, Notifier(settings.data, "web"), 2, Admission())
    monkeypatch.setattr("parenting.server.streams.AGAIN_SECONDS", 3600)
    looks, watched = {mine.run_id: 0, other.run_id: 0}, streams.subscriptions

    def leases(run: int) -> Callable[[], Any]:
        async def try_it() -> object:
            looks[run] += 1
            return lease(db, run, "a")

        return try_it

    async def here() -> bool:
        return False

    async def both() -> list[Any]:
        streams.open()
        waits = [asyncio.ensure_future(streams.wait_for(run, leases(run), 20, here)) for run in looks]
        while any(one.offers is None for one in watched.values()) or len(watched) < 2:
            await asyncio.sleep(0.01)  # until the watcher has first seen both, which wakes nobody
        await asyncio.to_thread(post_query, db, other, 1, "guidance", 1, CLIPS)
        found = await waits[1]
        await asyncio.to_thread(post_query, db, mine, 1, "guidance", 1, CLIPS)
        found = [await waits[0], found]
        streams.end()
        return found

    assert [query.run_id for query in asyncio.run(both())] == list(looks)
    assert set(looks.values()) == {2}  # one at once, one when its run has asked

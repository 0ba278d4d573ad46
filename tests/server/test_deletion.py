"""A run is deleted for good, in pieces, whatever a worker and a parent do meanwhile; a tombstone stays."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import httpx2
import pytest
from sqlalchemy import func, insert, select
from sqlalchemy import text as sql

from parenting.server import deletion, jobs, weights
from parenting.server.checkpoints import save_checkpoint
from parenting.server.db import Database
from parenting.server.errors import ElsewhereError, LostClaimError, NotFound
from parenting.server.identity import database_id
from parenting.server.metrics import write_metrics
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.progress import report_progress
from parenting.server.queue import answers, leases, revisions, worker_side
from parenting.server.queue.names import Names
from parenting.server.reads.listing import Wanted, find_runs
from parenting.server.runs import Claim, claim, get_run, set_status
from parenting.server.settings import Settings
from parenting.server.sizes import sizes, tables_of_runs
from parenting.server.statuses import RunStatus
from parenting.server.tables import Metric, Query, Run, Tombstone, Weights
from parenting.server.weights import put_bytes
from parenting.server.work.chores import Chores
from parenting.server.worker import Worker
from parenting.weights.origin import Origin
from parenting.weights.store import digest
from tests.server.conftest import CLIPS, Clock


def full(db: Database, mine: Claim) -> int:
    """Give a run rows of every kind, with an answer that supersedes another; return its last question."""
    for tick in (1, 2, 3):
        query = worker_side.post_query(db, mine, tick, "guidance", 1, CLIPS)
        answers.answer(db, query, "left", "me", "human")
        worker_side.take_answer(db, mine, tick + 10)
    revisions.supersede(db, query, "right", "me", "human")
    write_metrics(db, mine, {tick: {"deaths": tick} for tick in range(5)})
    save_checkpoint(db, mine, 4, b"checkpoint")
    add_operator_event(db, mine.run_id, "end_episode", {})
    jobs.ask(db, mine.run_id, "walk", {}, "me")
    return query


def rows_of(db: Database, run_id: int) -> dict[str, int]:
    counted = {}
    with db.read() as session:
        for table in tables_of_runs():
            counts = select(func.count()).select_from(table).where(table.c.run_id == run_id)
            counted[table.name] = session.scalar(counts) or 0
    return counted


def delete(db: Database, run_id: int) -> Tombstone:
    return deletion.delete_run(db, run_id)


def test_all_of_it_goes_and_nothing_of_another_run(db: Database, mine: Claim) -> None:
    full(db, mine)
    other = start(db, NewRun(world="unsafe-exploration"))
    (theirs,) = claim(db, "worker-2")
    full(db, theirs)
    before, held = rows_of(db, other.id), deletion.holds(db, mine.run_id)
    assert all(before[name] for name in ("answer", "checkpoint", "event", "job", "metric", "query"))
    stone = delete(db, mine.run_id)
    assert not any(rows_of(db, mine.run_id).values())
    assert rows_of(db, other.id) == before
    with pytest.raises(NotFound):
        get_run(db, mine.run_id)
    assert stone.gone is not None
    assert {name: stone.held[name] for name in held._fields} == held._asdict()
    assert (held.answers, held.questions, held.checkpoints, held.metrics) == (4, 3, 1, 5)
    assert held.bytes > len(b"checkpoint")


def test_neither_its_numbers_nor_its_public_ids_are_given_again(db: Database, mine: Claim) -> None:
    last = full(db, mine)
    name = get_run(db, mine.run_id).public_id
    delete(db, mine.run_id)
    fresh = start(db, NewRun(world="unsafe-exploration"))
    (theirs,) = claim(db, "worker-2")
    assert fresh.id == mine.run_id + 1
    assert fresh.public_id != name
    assert worker_side.post_query(db, theirs, 1, "guidance", 1, CLIPS) > last
    assert [stone.id for stone in deletion.tombstones(db)] == [mine.run_id]


def test_nothing_that_people_wrote_is_left(db: Database, mine: Claim) -> None:
    with db.write() as session:
        run = session.get_one(Run, mine.run_id)
        run.name, run.description, run.tags = "Ada Lovelace", "her first", ",ada,"
    stone = delete(db, mine.run_id)
    assert not any(word in str(vars(stone)).lower() for word in ("ada", "first"))
    assert stone.held["world"] == "unsafe-exploration"


def inheriting(db: Database, policy: bytes, answers: bytes = b"x") -> int:
    """Start a run that begins with bytes of an earlier one; none of them is read here."""
    blobs = (("first.safetensors", policy), ("first.jsonl", answers))
    parts = {
        name: {"stored": digest(blob)} for name, (_, blob) in zip(("policy", "answers"), blobs, strict=True)
    }
    return start(db, NewRun(world="unsafe-exploration"), origin=Origin(about=parts, blobs=blobs)).id


def kept(db: Database) -> set[bytes]:
    with db.read() as session:
        return set(session.scalars(select(Weights.blob)))


def test_what_it_alone_began_with_goes_with_it(db: Database) -> None:
    """The policy of two runs goes with the last; pre-trained weights stay for runs to come."""
    put_bytes(db, "side-effects-6x6-v1.safetensors", b"pre-trained")
    before = kept(db)
    one, two = inheriting(db, b"shared", b"of one"), inheriting(db, b"shared", b"of two")
    assert kept(db) == before | {b"shared", b"of one", b"of two"}
    delete(db, one)
    assert kept(db) == before | {b"shared", b"of two"}
    delete(db, two)
    assert kept(db) == before >= {b"pre-trained"}


def test_a_worker_removes_what_earlier_versions_left(
    db: Database, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not what a run begins with, nor what was stored a minute ago for a run to come."""
    before = kept(db)
    run = inheriting(db, b"in use")
    monkeypatch.setattr(deletion, "remove_unused", lambda *_: 0)  # as up to version 0.5
    delete(db, inheriting(db, b"left", b"left, too"))
    put_bytes(db, "side-effects.safetensors", b"of no run")
    clock.pass_seconds(3600 + 1)
    put_bytes(db, "side-effects.safetensors", b"young")
    chores = Chores(db, 10)
    chores.go_on()
    assert kept(db) == before | {b"in use", b"x", b"young"}
    with db.write() as session:
        session.execute(sql("UPDATE run SET origin = '5' WHERE id = :id"), {"id": run})
    delete(db, inheriting(db, b"stays"))
    assert weights.sweep(db) == 0  # nobody knows what the damaged one began with


def test_a_worker_that_raises_it_loses_it(db: Database, mine: Claim) -> None:
    full(db, mine)
    deletion.begin(db, mine.run_id)
    for write in (
        lambda: report_progress(db, mine, tick=9),
        lambda: worker_side.post_query(db, mine, 9, "guidance", 1, CLIPS),
        lambda: save_checkpoint(db, mine, 9, b"more"),
        lambda: write_metrics(db, mine, {9: {}}),
    ):
        with pytest.raises(LostClaimError):
            write()
    assert claim(db, "worker-2") == []
    deletion.go_on(db, mine.run_id)
    with pytest.raises(LostClaimError, match="was deleted"):
        report_progress(db, mine, tick=9)


@pytest.mark.parametrize("gone", [False, True], ids=["while it is deleted", "afterwards"])
def test_an_answer_to_it_is_refused(db: Database, mine: Claim, gone: bool) -> None:
    heard = full(db, mine)
    query = worker_side.post_query(db, mine, 20, "guidance", 1, CLIPS)
    name = get_run(db, mine.run_id).public_id
    deletion.begin(db, mine.run_id)
    if gone:
        deletion.go_on(db, mine.run_id)
    stated = Names(database_id(db), name)
    for verb, asked in ((answers.answer, query), (revisions.supersede, heard)):
        with pytest.raises(NotFound):
            verb(db, asked, "left", "me", "human")
        with pytest.raises(ElsewhereError):  # the page keeps what it was told
            verb(db, asked, "left", "me", "human", stated)
    for act in (
        lambda: set_status(db, mine.run_id, RunStatus.ACTIVE),
        lambda: add_operator_event(db, mine.run_id, "end_episode", {}),
        lambda: jobs.ask(db, mine.run_id, "walk", {}, "me"),
        lambda: deletion.begin(db, mine.run_id),
    ):
        with pytest.raises(NotFound):
            act()
    assert leases.waiting(db, mine.run_id) is None


def test_a_deletion_that_was_killed_goes_on_where_it_was(
    db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After each piece the list still shows it; the worker deletes the rest."""
    monkeypatch.setattr(deletion, "ROWS", 2)
    full(db, mine)
    held = deletion.holds(db, mine.run_id)
    left = [sum(rows_of(db, mine.run_id).values())]
    deletion.begin(db, mine.run_id)
    for _ in range(4):
        assert not deletion.go_on(db, mine.run_id, 0)
        left.append(sum(rows_of(db, mine.run_id).values()))
        assert [run.deleting is not None for run in find_runs(db, Wanted(), None, 9).rows] == [True]
    assert all(0 <= before - now <= 2 for before, now in pairwise(left))
    assert left[-1] < left[0]
    stone = delete(db, mine.run_id)
    assert (stone.gone is not None, stone.held["answers"]) == (True, held.answers)


@pytest.mark.slow
def test_the_loop_of_a_worker_drops_the_run_deletes_it_and_raises_the_others(
    db: Database, settings: Settings
) -> None:
    first, second = (start(db, NewRun(world="unsafe-exploration")).id for _ in range(2))
    worker = Worker(db, settings)
    rounds(worker, lambda: len(worker.sessions) == 2 and get_run(db, first).waiting == "guidance")
    deletion.begin(db, first)
    with db.write() as session:
        session.execute(
            insert(Metric), [{"run_id": first, "tick": 1000 + at, "values": {}} for at in range(500)]
        )
    rounds(worker, lambda: not deletion.under_way(db) and first not in worker.sessions)
    assert [run.id for run in find_runs(db, Wanted(), None, 9).rows] == [second]
    with db.read() as session:
        (query,) = session.scalars(select(Query.id).where(Query.run_id == second))
    answers.answer(db, query, "left", "me", "human")
    tick = get_run(db, second).tick
    rounds(worker, lambda: get_run(db, second).tick > tick)
    worker.notifier.close()


def rounds(worker: Worker, met: Any) -> None:
    for _ in range(3000):
        if met():
            return
        worker._go_on()
    raise AssertionError("it never came to that")


def test_over_http_it_says_what_it_holds_and_asks(client: httpx2.Client, db: Database, mine: Claim) -> None:
    full(db, mine)
    held = client.get(f"/api/v1/runs/{mine.run_id}/holds").json()
    assert (held["answers"], held["bytes"]) == (4, sizes(db, [mine.run_id])[mine.run_id])
    url = f"/api/v1/runs/{mine.run_id}/delete"
    assert client.post(url, json={}).status_code == 422
    assert client.post(url, json={"confirm": "5J3mBbAH58CpQ3Y8RNJpUK"}).status_code == 409
    stone: dict[str, Any] = {"gone": None}
    while stone["gone"] is None:  # a request deletes for a second
        stone = client.post(url, json={"confirm": held["public_id"]}).json()
    assert (stone["held"]["answers"], client.get(f"/api/v1/runs/{mine.run_id}").status_code) == (4, 404)
    assert client.get("/api/v1/tombstones").json() == {"rows": [stone], "next": None}
    assert client.post(url, json={"confirm": held["public_id"]}).status_code == 404

"""Requests that share a transaction: each gets its own reply, and none before the commit (A1, A3, D2)."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import pytest
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from parenting.server.db import Database
from parenting.server.errors import BusyError, Conflict, DiskFullError, NotFound, ServerError
from parenting.server.group_commit import GroupCommit
from parenting.server.queue.answers import Said, answer, answer_in
from parenting.server.queue.leases import is_offered, lease, lease_in
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.tables import Answer
from tests.faults import tap
from tests.faults.refusals import SQLITE, error_of
from tests.faults.tap import COMMIT, Moment
from tests.server.conftest import CLIPS

pytestmark = pytest.mark.only("sqlite", "PostgreSQL's transactions write beside each other")
NUMBER = 6


@pytest.fixture
def group(db: Database) -> Iterator[GroupCommit]:
    found = GroupCommit(db)
    yield found
    found.close()


@pytest.fixture
def queries(db: Database, mine: Claim) -> list[int]:
    return [post_query(db, mine, tick, "guidance", 1, CLIPS) for tick in range(NUMBER)]


def answering(db: Database, query: int, client: str = "ann") -> Callable[[Session], Any]:
    return lambda session: answer_in(session, db, query, Said("left", client, "human"))


def in_one_group(
    group: GroupCommit, db: Database, verbs: Sequence[Callable[[Session], Any]], seconds: float = 5.0
) -> Any:
    """The results or errors of verbs that wait for one transaction together."""

    async def together() -> list[Any]:
        with db.write():
            first = asyncio.ensure_future(group.store(lambda _session: None, seconds))
            await asyncio.sleep(0.1)  # it waits for its turn, and those that come now wait behind it
            waiting = [asyncio.ensure_future(group.store(verb, seconds)) for verb in verbs]
            await asyncio.sleep(0)
        await first
        return await asyncio.gather(*waiting, return_exceptions=True)

    return in_a_loop(together)


def in_a_loop(test: Callable[[], Awaitable[Any]]) -> Any:
    """Run a coroutine in a thread: a browser that another test left open has a loop in this one."""

    async def whole() -> Any:
        return await test()

    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, whole()).result()


def stored(db: Database) -> int:
    with db.read() as session:
        return session.scalars(select(func.count()).select_from(Answer)).one()


class Seen:
    """The commits that wrote an answer, and how many answers each held."""

    def __init__(self) -> None:
        self.groups: list[int] = []

    def __call__(self, moment: Moment) -> None:
        answers = sum(one.startswith("INSERT INTO answer") for one in moment.writes)
        if moment.when == "after" and moment.act == COMMIT and answers:
            self.groups.append(answers)


def test_what_waits_together_is_committed_together(
    db: Database, group: GroupCommit, queries: list[int]
) -> None:
    with tap.listening(seen := Seen()):
        found = in_one_group(group, db, [answering(db, query) for query in queries])
    assert seen.groups == [NUMBER]
    assert [one.number for one in found] == list(range(1, NUMBER + 1))
    again = in_one_group(group, db, [answering(db, query) for query in queries])
    assert again == found


def test_no_more_than_most_share_a_commit(db: Database, queries: list[int]) -> None:
    group = GroupCommit(db, most=4)
    with tap.listening(seen := Seen()):
        in_one_group(group, db, [answering(db, query) for query in queries])
    assert seen.groups == [4, 2]
    group.close()


def test_who_is_refused_hurts_nobody_else(db: Database, group: GroupCommit, queries: list[int]) -> None:
    answer(db, queries[0], "right", "bob", "human")
    verbs = [answering(db, query) for query in (queries[0], queries[1], 999, queries[2], queries[2])]
    verbs[-1] = answering(db, queries[2], client="bob")

    def fails(session: Session) -> None:
        answer_in(session, db, queries[3], Said("left", "ann", "human"))
        raise ZeroDivisionError

    found = in_one_group(group, db, [*verbs, fails, answering(db, queries[4])])
    kinds = [type(one) for one in found if isinstance(one, Exception)]
    assert kinds == [Conflict, NotFound, Conflict, ZeroDivisionError]
    assert [one.number for one in found if not isinstance(one, Exception)] == [2, 3, 4]
    assert stored(db) == 4  # nothing is left of what failed after it had written
    assert answer(db, queries[3], "right", "bob", "human").number == 5


def test_nobody_is_told_before_the_commit(db: Database, group: GroupCommit, queries: list[int]) -> None:
    told, ahead = list[int](), list[int]()

    def listener(moment: Moment) -> None:
        if moment.when == "before" and moment.act == COMMIT and moment.writes:
            time.sleep(0.1)  # whoever was told already has the time to hear it
            ahead.append(len(told) - stored(db))

    async def tell(query: int) -> None:
        await group.store(answering(db, query), 5)
        told.append(query)

    async def whole() -> None:
        await asyncio.gather(*map(tell, queries))

    with tap.listening(listener):
        in_a_loop(whole)
    assert ahead, "nothing was committed"
    assert max(ahead) <= 0
    assert sorted(told) == queries


def test_commit_that_fails_is_told_to_all(db: Database, group: GroupCommit, queries: list[int]) -> None:
    full = next(one for one in SQLITE if one.name == "SQLITE_FULL")

    def refuse(moment: Moment) -> None:
        if moment.when == "before" and moment.act == COMMIT and len(moment.writes) > 3:
            raise error_of("sqlite", full)

    verbs = [answering(db, query) for query in queries]
    with tap.listening(refuse):
        found = in_one_group(group, db, verbs)
    assert {type(one) for one in found} == {DiskFullError}
    assert stored(db) == 0
    assert [one.number for one in in_one_group(group, db, verbs)] == list(range(1, NUMBER + 1))


def test_statement_that_the_store_refuses_costs_one_request(
    db: Database, group: GroupCommit, queries: list[int]
) -> None:
    damaged = next(one for one in SQLITE if one.name == "SQLITE_CORRUPT")

    def broken(session: Session) -> None:
        answer_in(session, db, queries[1], Said("left", "ann", "human"))
        raise error_of("sqlite", damaged)

    verbs = [answering(db, query) for query in queries]
    found = in_one_group(group, db, [verbs[0], broken, *verbs[2:]])
    assert [isinstance(one, ServerError) and one.code for one in found].count("store_damaged") == 1
    assert isinstance(found[1], ServerError)
    assert stored(db) == NUMBER - 1


def test_who_waits_for_too_long_is_refused_and_the_others_are_not(
    db: Database, group: GroupCommit, queries: list[int]
) -> None:
    async def whole() -> list[Any]:
        with db.write():
            short = [asyncio.ensure_future(group.store(answering(db, query), 0.2)) for query in queries[:3]]
            long = [asyncio.ensure_future(group.store(answering(db, query), 30)) for query in queries[3:]]
            refused = await asyncio.gather(*short, return_exceptions=True)
            assert not any(one.done() for one in long)
        return [*refused, *await asyncio.gather(*long)]

    found = in_a_loop(whole)
    assert [type(one) for one in found[:3]] == [BusyError] * 3
    assert sorted(one.number for one in found[3:]) == [1, 2, 3]


def test_full_queue_refuses_at_once(db: Database, queries: list[int]) -> None:
    group = GroupCommit(db, most=1, waiting=1)

    async def whole() -> None:
        with db.write():
            waiting = [asyncio.ensure_future(group.store(answering(db, query), 30)) for query in queries[:2]]
            await asyncio.sleep(0)
            with pytest.raises(BusyError, match="Too many requests wait"):
                await group.store(answering(db, queries[2]), 30)
            assert not any(one.done() for one in waiting)
        await asyncio.gather(*waiting)
        assert group.waiting == 0
        await group.store(answering(db, queries[2]), 30)

    in_a_loop(whole)
    group.close()


def test_leases_of_one_group_are_of_different_questions(
    db: Database, mine: Claim, group: GroupCommit, queries: list[int]
) -> None:
    verbs = [partial(_lease, db, mine.run_id, f"client-{number}") for number in range(NUMBER)]
    found = in_one_group(group, db, verbs)
    assert found == queries
    assert in_one_group(group, db, verbs) == queries  # each gets its own again


def _lease(db: Database, run: int, client: str, session: Session) -> int | None:
    query = lease_in(session, db, run, client, 60)
    return None if query is None else query.id


def test_nothing_to_write_takes_no_lock(
    db: Database, mine: Claim, group: GroupCommit, queries: list[int]
) -> None:
    for number in range(NUMBER):
        lease(db, mine.run_id, f"client-{number}")

    async def whole() -> Any:
        with db.write():  # nobody else can write meanwhile
            verb = partial(_lease, db, mine.run_id, "late")
            worth = partial(_offered, db, mine.run_id)
            return await group.store(verb, 5, durable=False, worth=worth)

    assert in_a_loop(whole) is None


def _offered(db: Database, run: int, session: Session) -> bool:
    return is_offered(session, db, run, "late")

"""A page that shares its browser's stream has two questions at most, and guidance beyond that."""

import pytest

from parenting.server.db import Database
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease_more, release
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.tables import Run
from tests.server.conftest import CLIPS


@pytest.fixture
def preferences(db: Database, mine: Claim) -> list[int]:
    return [post_query(db, mine, tick, "preference", 1, CLIPS) for tick in range(2, 6)]


def more(db: Database, run: Run, has: set[int], client: str = "a") -> int | None:
    query = lease_more(db, run.id, client, has)
    if query is None:
        return None
    has.add(query.id)
    return query.id


def test_page_gets_two_questions_and_another_one_for_each_that_is_answered(
    db: Database, run: Run, preferences: list[int]
) -> None:
    has: set[int] = set()
    assert [more(db, run, has) for _ in range(3)] == [*preferences[:2], None]
    answer(db, preferences[0], "left", "a", "human")
    assert [more(db, run, has) for _ in range(2)] == [preferences[2], None]
    assert has == set(preferences[1:3])


def test_guidance_comes_beyond_that(db: Database, run: Run, mine: Claim, preferences: list[int]) -> None:
    has: set[int] = set()
    assert [more(db, run, has) for _ in range(2)] == preferences[:2]
    urgent = post_query(db, mine, 7, "guidance", 1, CLIPS)
    assert [more(db, run, has) for _ in range(2)] == [urgent, None]


def test_what_a_page_gave_up_goes_to_others_first(db: Database, run: Run, preferences: list[int]) -> None:
    has: set[int] = set()
    more(db, run, has)
    release(db, preferences[0], "a")
    assert (more(db, run, has), has) == (None, set())
    assert more(db, run, set(), "b") == preferences[0]
    assert more(db, run, has) == preferences[1]

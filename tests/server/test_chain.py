"""The chain of hashes names an answer that was changed, removed or put elsewhere, and no erased one."""

from __future__ import annotations

import json

import pytest
from sqlalchemy import text

from parenting.server.chain import AT_ANSWER, AT_MIGRATION, check
from parenting.server.db import Database
from parenting.server.migrate import downgrade, upgrade
from parenting.server.queue.answers import answer
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.reads.answers import every
from parenting.server.runs import Claim
from tests.server.conftest import CLIPS, Clock

NUMBER = 5
BEFORE = "0007"
"""The revision before the chain."""


@pytest.fixture
def run_id(db: Database, mine: Claim, clock: Clock) -> int:
    """Four answers, of which the last is corrected; two are heard."""
    for tick, choice in enumerate(("left", "right", "either", "neither")):
        query = post_query(db, mine, 2 * tick, "preference", 2, CLIPS, policy=(2, 30 + tick))
        clock.pass_seconds(0.123456)
        answer(db, query, choice, "tab", "human")
    supersede(db, query, "left", "tab", "human")
    take_answer(db, mine, 10)
    take_answer(db, mine, 11)
    return mine.run_id


def change(db: Database, statement: str) -> None:
    with db.write() as session:
        session.execute(text(statement))


def test_it_holds_whatever_may_change_later(db: Database, run_id: int) -> None:
    found = check(db, run_id)
    assert (found.answers, found.erased, found.migrated, found.problems) == (NUMBER, 0, 0, [])
    rows = [row.answer for row in every(db, run_id)]
    assert {row.chained for row in rows} == {AT_ANSWER}
    assert len({row.salt for row in rows}) == len({row.link for row in rows}) == NUMBER


@pytest.mark.parametrize(
    ("statement", "problems"),
    [
        ("UPDATE answer SET choice = 'right' WHERE number = 1", ["answer 1 or its question was changed"]),
        ("UPDATE answer SET client_id = 'who' WHERE number = 2", ["answer 2 or its question was changed"]),
        ("UPDATE query SET maturity = 1 WHERE id = 3", ["answer 3 or its question was changed"]),
        (
            "UPDATE answer SET digest = 'x' WHERE number = 3",
            ["answer 3 or its question was changed", "answer 3 does not follow answer 2 in the chain"],
        ),
        ("DELETE FROM answer WHERE number = 2", ["answer 2 is missing"]),
        ("DELETE FROM answer WHERE number = 5", ["answer 5 is missing"]),
        (
            "UPDATE answer SET number = 9 - number WHERE number IN (1, 2)",
            ["answer 1 is missing", "answer 2 is missing"],
        ),
    ],
)
def test_what_was_done_to_a_row_is_named(
    db: Database, run_id: int, statement: str, problems: list[str]
) -> None:
    change(db, statement)
    assert check(db, run_id).problems[: len(problems)] == problems


def test_two_answers_in_each_others_place_are_named(db: Database, run_id: int) -> None:
    """With their hashes too, so that each row is whole: only the chain can tell."""
    for number, other in ((1, 101), (2, 1), (101, 2)):
        change(db, f"UPDATE answer SET number = {other} WHERE number = {number}")
    assert "answer 1 does not follow answer 0 in the chain" in check(db, run_id).problems


def test_an_erased_answer_keeps_its_place(db: Database, run_id: int) -> None:
    change(db, "UPDATE answer SET salt = NULL, client_id = '', choice = 'neither' WHERE number = 2")
    found = check(db, run_id)
    assert (found.erased, found.problems) == (1, [])


def test_the_order_of_keys_says_nothing(db: Database, run_id: int) -> None:
    """Another store or program may write the same JSON otherwise."""
    turned = json.dumps(dict(reversed(CLIPS.items())), indent=1).replace("'", "''")
    change(db, f"UPDATE query SET clips = '{turned}' WHERE id = 1".replace(":", r"\:"))
    assert check(db, run_id).problems == []


def test_hashes_are_stored_as_bytes_and_as_digits_for_an_older_version(db: Database, run_id: int) -> None:
    change(db, "UPDATE answer SET digest = 'text:x' WHERE number = 3")  # no digits, as damage leaves it
    hashed = [(row.answer.salt, row.answer.digest, row.answer.link) for row in every(db, run_id)]
    before = check(db, run_id)
    assert stored(db) == [(16, 32, 32), (16, 32, 32), (16, 6, 32), (16, 32, 32), (16, 32, 32)]
    downgrade(db, "0030")
    assert [tuple(map(len, map(str, row))) for row in stored_text(db)] == [
        (32, 64 if number != 3 else len(str(hashed[2][1])), 64) for number in range(1, NUMBER + 1)
    ]
    upgrade(db)
    assert [(row.answer.salt, row.answer.digest, row.answer.link) for row in every(db, run_id)] == hashed
    assert check(db, run_id) == before


def stored_text(db: Database) -> list[tuple[str, str, str]]:
    """Return salt, digest and link of each answer as they are stored."""
    with db.read() as session:
        rows = session.execute(text("SELECT salt, digest, link FROM answer ORDER BY number"))
        return [(row[0], row[1], row[2]) for row in rows]


def stored(db: Database) -> list[tuple[int, ...]]:
    """Return the bytes of salt, digest and link of each answer."""
    return [tuple(map(len, row)) for row in stored_text(db)]


def test_answers_of_before_are_hashed_by_the_migration(db: Database, run_id: int) -> None:
    downgrade(db, BEFORE)
    upgrade(db)
    found = check(db, run_id)
    assert (found.answers, found.migrated, found.problems) == (NUMBER, NUMBER, [])
    assert {row.answer.chained for row in every(db, run_id)} == {AT_MIGRATION}
    query = next(every(db, run_id)).query.id
    supersede(db, query, "either", "tab", "human")
    found = check(db, run_id)
    assert (found.answers, found.migrated, found.problems) == (NUMBER + 1, NUMBER, [])
    change(db, "UPDATE answer SET choice = 'right' WHERE number = 1")
    assert check(db, run_id).problems == ["answer 1 or its question was changed"]


def test_a_downgrade_leaves_no_note_that_older_versions_do_not_know(db: Database, run_id: int) -> None:
    change(
        db,
        "INSERT INTO event (run_id, kind, payload, created, applied_tick) "
        "VALUES (1, 'resumed', '{}', '2026-11-22 12\\:00\\:00', 3)",
    )
    downgrade(db, BEFORE)
    with db.read() as session:
        assert session.execute(text("SELECT count(*) FROM event")).scalar() == 0

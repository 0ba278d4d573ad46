"""The answers of a run, page by page."""

from __future__ import annotations

import pytest

from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.queue.answers import answer
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query
from parenting.server.reads import answers
from parenting.server.runs import Claim
from tests.server.conftest import CLIPS

CHOICES = ("left", "right", "either", "neither", "left")


@pytest.fixture
def five(db: Database, mine: Claim) -> int:
    """A run with five answers, the last of which was corrected: six rows."""
    for tick, choice in enumerate(CHOICES):
        last = post_query(db, mine, tick, "guidance", 1, CLIPS)
        answer(db, last, choice, "me", "human")
    supersede(db, last, "right", "me", "human")
    return mine.run_id


def numbers(rows: object) -> list[int]:
    return [row.answer.number for row in rows]  # type: ignore[attr-defined]


def test_forwards_and_backwards(db: Database, five: int) -> None:
    assert numbers(answers.after(db, five, limit=4)) == [1, 2, 3, 4]
    assert numbers(answers.after(db, five, 4)) == [5, 6]
    assert numbers(answers.before(db, five, limit=2)) == [6, 5]
    assert numbers(answers.before(db, five, 3)) == [2, 1]


def test_each_comes_with_its_question(db: Database, five: int) -> None:
    rows = answers.after(db, five)
    assert [row.query.tick for row in rows] == [0, 1, 2, 3, 4, 4]
    assert [row.answer.standing for row in rows] == [True] * 4 + [False, True]
    assert rows[-1].answer.supersedes == rows[-2].answer.id


@pytest.mark.parametrize("batch", [1, 4, 6, 100])
def test_every_answer_once(db: Database, five: int, batch: int) -> None:
    assert numbers(answers.every(db, five, batch)) == [1, 2, 3, 4, 5, 6]


def test_what_is_answered_meanwhile_does_not_prolong_it(db: Database, mine: Claim, five: int) -> None:
    rows = answers.every(db, five, 2)
    next(rows)
    answer(db, post_query(db, mine, 9, "guidance", 1, CLIPS), "left", "me", "human")
    assert numbers(rows) == [2, 3, 4, 5, 6]


@pytest.mark.parametrize("verb", [answers.after, answers.before])
def test_unknown_run(db: Database, verb: object) -> None:
    assert callable(verb)
    with pytest.raises(NotFound):
        verb(db, 9)


def test_by_kind_and_choice(db: Database, mine: Claim, five: int) -> None:
    answer(db, post_query(db, mine, 9, "preference", 1, CLIPS), "left", "me", "human")
    assert numbers(answers.before(db, five, kind="preference")) == [7]
    assert numbers(answers.before(db, five, choice="left")) == [7, 5, 1]
    assert numbers(answers.before(db, five, 7, kind="guidance", choice="left", limit=1)) == [5]

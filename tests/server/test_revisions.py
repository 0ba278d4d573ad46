"""Second thoughts: an answer that was not heard is taken back, one that was is changed; one's own alone."""

from __future__ import annotations

import httpx2
import pytest
from sqlalchemy import select

from parenting.server.chain import check
from parenting.server.db import Database
from parenting.server.errors import Conflict, ElsewhereError
from parenting.server.export import rows
from parenting.server.identity import database_id
from parenting.server.migrate import downgrade, upgrade
from parenting.server.queue.answers import answer, get_query
from parenting.server.queue.corrections import take_correction
from parenting.server.queue.leases import lease, lease_ahead
from parenting.server.queue.names import Names
from parenting.server.queue.revisions import supersede, withdraw
from parenting.server.queue.worker_side import post_query, take_answer, watch
from parenting.server.reads.schemas import run_schema
from parenting.server.runs import Claim, get_run, set_goal, set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import Answer
from tests.server.conftest import CLIPS


def stored(db: Database) -> list[tuple[int, str, bool, int | None]]:
    """The rows of answers: number, choice, whether it stands, and the id of the row that it supersedes."""
    with db.read() as session:
        found = session.scalars(select(Answer).order_by(Answer.number)).all()
        return [(row.number, row.choice, row.standing, row.supersedes) for row in found]


def test_an_answer_that_was_not_heard_is_asked_again_of_the_same_client(
    db: Database, mine: Claim, guidance: int
) -> None:
    answer(db, guidance, "left", "a", "human")
    found = withdraw(db, guidance, "a")
    assert (found.outcome, found.choice) == ("withdrawn", "left")
    assert get_query(db, guidance).status == "open"
    assert watch(db, [mine.run_id])[mine.run_id].answered == 0
    assert take_answer(db, mine, 6) is None
    assert lease(db, mine.run_id, "b") is None, "it is leased to whom it was taken back by"
    again = lease(db, mine.run_id, "a")
    assert again is not None
    assert again.id == guidance
    assert stored(db) == [(1, "left", False, None)]


def test_taking_an_answer_back_twice_is_taking_it_back_once(db: Database, mine: Claim, guidance: int) -> None:
    answer(db, guidance, "left", "a", "human")
    for _ in range(3):
        assert withdraw(db, guidance, "a").outcome == "withdrawn"
    assert get_run(db, mine.run_id).retracted == 1


def test_the_answer_after_one_that_was_taken_back_names_its_row(
    db: Database, mine: Claim, guidance: int
) -> None:
    answer(db, guidance, "left", "a", "human")
    withdraw(db, guidance, "a")
    assert answer(db, guidance, "left", "a", "human").number == 2, "the same choice is another row"
    withdraw(db, guidance, "a")
    answer(db, guidance, "either", "b", "human")
    first, second, third = stored(db)
    assert [row[2] for row in (first, second, third)] == [False, False, True]
    assert (first[3], second[3], third[3]) == (None, 1, 2)
    taken = take_answer(db, mine, 6)
    assert taken is not None
    assert taken.answer.choice == "either"
    assert check(db, mine.run_id).problems == []
    told = [(row["standing"], row["supersedes"]) for row in rows(db, mine.run_id)]
    assert told == [(False, None), (False, 1), (True, 2)]


def test_an_answer_that_was_heard_stays_and_may_be_changed(db: Database, mine: Claim, guidance: int) -> None:
    answer(db, guidance, "left", "a", "human")
    take_answer(db, mine, 6)
    found = withdraw(db, guidance, "a")
    assert (found.outcome, found.choice) == ("heard", "left")
    assert stored(db) == [(1, "left", True, None)]
    assert supersede(db, guidance, "right", "a", "human").heard
    assert withdraw(db, guidance, "a").outcome == "heard", "a correction on its way is changed, too"
    assert watch(db, [mine.run_id])[mine.run_id].answered == 1


def test_a_change_whose_reply_was_lost_may_be_sent_again(db: Database, guidance: int) -> None:
    answer(db, guidance, "left", "a", "human")
    assert supersede(db, guidance, "right", "a", "human") == supersede(db, guidance, "right", "a", "human")
    assert [row[:3] for row in stored(db)] == [(1, "left", False), (2, "right", True)]


def test_a_second_change_corrects_what_was_heard_before_both(
    db: Database, mine: Claim, guidance: int
) -> None:
    answer(db, guidance, "left", "a", "human")
    take_answer(db, mine, 6)
    supersede(db, guidance, "right", "a", "human")
    supersede(db, guidance, "either", "a", "human")
    found = take_correction(db, mine, 7)
    assert found is not None
    assert (found.answer.choice, found.replaced.choice) == ("either", "left")
    assert [taken.answer.choice for taken in found.standing] == ["either"]
    assert take_correction(db, mine, 8) is None


def test_nobody_changes_or_takes_back_what_another_said(db: Database, guidance: int) -> None:
    answer(db, guidance, "left", "a", "human")
    with pytest.raises(Conflict, match="someone else"):
        withdraw(db, guidance, "b")
    with pytest.raises(Conflict, match="someone else"):
        supersede(db, guidance, "right", "b", "human")
    assert stored(db) == [(1, "left", True, None)]


def test_who_never_answered_takes_nothing_back_and_no_lease(db: Database, mine: Claim, guidance: int) -> None:
    found = withdraw(db, guidance, "b")
    assert (found.outcome, found.choice) == ("withdrawn", None)
    assert lease(db, mine.run_id, "a") is not None, "it is nobody's"
    withdraw(db, guidance, "b")
    answer(db, guidance, "left", "a", "human")
    assert stored(db) == [(1, "left", True, None)]


def test_in_a_run_that_is_over_nothing_is_asked_again(db: Database, mine: Claim, guidance: int) -> None:
    answer(db, guidance, "left", "a", "human")
    set_status(db, mine.run_id, RunStatus.STOPPED)
    with pytest.raises(Conflict, match="over"):
        withdraw(db, guidance, "a")
    assert stored(db) == [(1, "left", True, None)]


def test_names_of_elsewhere_change_nothing(db: Database, guidance: int) -> None:
    answer(db, guidance, "left", "a", "human")
    with pytest.raises(ElsewhereError):
        withdraw(db, guidance, "a", Names(database="7c9e6679-7425-40de-944b-e07fc1f90ae7"))
    with pytest.raises(ElsewhereError):
        supersede(db, guidance, "right", "a", "human", Names(run="5J3mBbAH58CpQ3Y8RNJpUK"))
    assert stored(db) == [(1, "left", True, None)]


def test_a_goal_counts_the_answers_that_stand(db: Database, mine: Claim) -> None:
    one, two = (post_query(db, mine, tick, "preference", 1, CLIPS) for tick in (1, 2))
    set_goal(db, mine.run_id, 1)
    answer(db, one, "left", "a", "human")
    assert lease(db, mine.run_id, "a") is None
    supersede(db, one, "right", "a", "human")
    assert run_schema(db, mine.run_id).resting
    assert lease(db, mine.run_id, "a") is None
    withdraw(db, one, "a")
    now = run_schema(db, mine.run_id)
    assert (now.resting, now.answers, now.standing) == (False, 2, 0)
    assert lease_ahead(db, mine.run_id, "a", [one]) is None, "with the one that is shown the goal is reached"
    again = lease(db, mine.run_id, "a")
    assert again is not None
    assert {one, two} >= {again.id}


def test_a_migration_counts_what_stands_no_more_and_back(db: Database, mine: Claim, guidance: int) -> None:
    other = post_query(db, mine, 7, "preference", 1, CLIPS)
    for query in (guidance, other):
        answer(db, query, "left", "a", "human")
        supersede(db, query, "right", "a", "human")
    downgrade(db, "0009")
    upgrade(db)
    assert get_run(db, mine.run_id).retracted == 2
    withdraw(db, guidance, "a")
    downgrade(db, "0009")
    upgrade(db)
    assert get_query(db, guidance).status == "answered", "the version before takes no second answer"
    assert get_run(db, mine.run_id).retracted == 2
    assert [row[2] for row in stored(db)] == [False, True, False, True]


def test_the_routes_take_back_and_change(
    client: httpx2.Client, db: Database, mine: Claim, guidance: int
) -> None:
    name, run = get_query(db, guidance).public_id, get_run(db, mine.run_id).public_id
    named = {"client_id": "a", "database": database_id(db), "run": run, "question": name}
    at = f"/api/v1/queries/{name}"
    assert client.post(f"{at}/change", json={**named, "choice": "left"}).status_code == 409
    assert client.post(f"{at}/answer", json={**named, "choice": "left"}).status_code == 200
    assert client.post(f"{at}/withdraw", json={**named, "client_id": "b"}).status_code == 409
    taken = client.post(f"{at}/withdraw", json=named).json()
    assert (taken["outcome"], taken["choice"], taken["query_public_id"]) == ("withdrawn", "left", name)
    assert client.post(f"{at}/answer", json={**named, "choice": "left"}).json()["number"] == 2
    take_answer(db, mine, 6)
    assert client.post(f"{at}/withdraw", json=named).json()["outcome"] == "heard"
    changed = client.post(f"{at}/change", json={**named, "choice": "neither"}).json()
    assert (changed["number"], changed["choice"], changed["heard"]) == (3, "neither", True)
    for verb, more in (("withdraw", {}), ("change", {"choice": "left"})):
        elsewhere = {**named, **more, "database": "7c9e6679-7425-40de-944b-e07fc1f90ae7"}
        assert client.post(f"{at}/{verb}", json=elsewhere).status_code == 410
    assert [row[2] for row in stored(db)] == [False, False, True]

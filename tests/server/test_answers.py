"""The parents' verbs: who is offered what, who may answer, and how often (A2, A4, B1 to B5)."""

import threading
from collections.abc import Callable

import pytest
from sqlalchemy import func, select, text
from sqlalchemy.exc import IntegrityError

from parenting.server.db import Database
from parenting.server.errors import Conflict, NotFound
from parenting.server.queue import answers
from parenting.server.queue.answers import answer, get_query
from parenting.server.queue.leases import LEASE_SECONDS, lease, lease_ahead, release
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query
from parenting.server.reads import pagination
from parenting.server.runs import Claim, get_run, set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import Answer, Run
from tests.server.conftest import CLIPS, Clock


def leased(db: Database, run: Run, client: str = "a") -> int | None:
    query = lease(db, run.id, client)
    return None if query is None else query.id


def count(db: Database) -> int:
    with db.read() as session:
        return session.execute(select(func.count()).select_from(Answer)).scalar_one()


def test_nothing_to_lease(db: Database, run: Run) -> None:
    assert lease(db, run.id, "a") is None


def test_guidance_goes_first_and_then_the_oldest(db: Database, run: Run, mine: Claim) -> None:
    late = post_query(db, mine, 9, "preference", 1, CLIPS)
    early = post_query(db, mine, 3, "preference", 1, CLIPS)
    guidance = post_query(db, mine, 12, "guidance", 1, CLIPS)
    assert [leased(db, run, client) for client in "abcd"] == [guidance, early, late, None]


def test_same_client_gets_the_same_question_again(db: Database, run: Run, mine: Claim, clock: Clock) -> None:
    first = post_query(db, mine, 1, "preference", 1, CLIPS)
    assert leased(db, run) == first
    post_query(db, mine, 2, "guidance", 1, CLIPS)  # more urgent, but this parent is looking at another
    clock.pass_seconds(LEASE_SECONDS - 1)
    assert leased(db, run) == first
    clock.pass_seconds(LEASE_SECONDS - 1)
    assert leased(db, run) == first, "leasing again renews the lease"


def test_leased_question_is_offered_again_when_its_lease_ends(
    db: Database, run: Run, guidance: int, clock: Clock
) -> None:
    assert leased(db, run, "a") == guidance
    clock.pass_seconds(LEASE_SECONDS - 1)
    assert leased(db, run, "b") is None
    clock.pass_seconds(1)
    assert leased(db, run, "b") == guidance
    assert leased(db, run, "a") is None, "it is b's now"


def test_release_offers_it_at_once_and_only_by_its_holder(db: Database, run: Run, guidance: int) -> None:
    leased(db, run, "a")
    release(db, guidance, "b")
    assert leased(db, run, "b") is None
    release(db, guidance, "a")
    assert leased(db, run, "b") == guidance


def test_same_answer_again_gets_the_same_reply(db: Database, run: Run, guidance: int, clock: Clock) -> None:
    first = answer(db, guidance, "left", "a", "human")
    clock.pass_seconds(100)
    assert answer(db, guidance, "left", "a", "human") == first
    assert count(db) == 1
    assert get_run(db, run.id).answers == 1
    assert get_query(db, guidance).status == "answered"


def test_another_answer_is_refused(db: Database, guidance: int) -> None:
    answer(db, guidance, "left", "a", "human")
    with pytest.raises(Conflict, match=r"already answered this question with left; right was not stored"):
        answer(db, guidance, "right", "a", "human")
    with pytest.raises(Conflict, match="answered by someone else"):
        answer(db, guidance, "left", "b", "human")
    assert count(db) == 1


def test_late_answer_is_taken_if_nobody_else_answered(
    db: Database, run: Run, guidance: int, clock: Clock
) -> None:
    leased(db, run, "a")
    clock.pass_seconds(LEASE_SECONDS + 1)
    assert leased(db, run, "b") == guidance
    assert answer(db, guidance, "either", "a", "human").number == 1
    with pytest.raises(Conflict):
        answer(db, guidance, "either", "b", "human")


def test_withdrawn_question_takes_no_answer(db: Database, run: Run, guidance: int) -> None:
    set_status(db, run.id, RunStatus.STOPPED)
    with pytest.raises(Conflict, match="withdrawn"):
        answer(db, guidance, "left", "a", "human")
    assert leased(db, run) is None


def test_answers_of_a_run_are_numbered(db: Database, run: Run, mine: Claim) -> None:
    queries = [post_query(db, mine, tick, "preference", 1, CLIPS) for tick in (1, 2, 3)]
    assert [answer(db, query, "left", "a", "human").number for query in reversed(queries)] == [1, 2, 3]


def test_correction_supersedes_and_overwrites_nothing(db: Database, guidance: int) -> None:
    first = answer(db, guidance, "left", "a", "human")
    corrected = supersede(db, guidance, "right", "a", "human")
    assert corrected.number == first.number + 1
    now = pagination.asked(db, guidance).answer
    assert now is not None
    assert (now.choice, now.supersedes) == ("right", 1)
    with db.read() as session:
        rows = session.scalars(select(Answer).order_by(Answer.number)).all()
        assert [(row.choice, row.standing) for row in rows] == [("left", False), ("right", True)]


def test_without_an_answer_there_is_nothing_to_supersede(db: Database, guidance: int) -> None:
    with pytest.raises(Conflict, match="no answer to supersede"):
        supersede(db, guidance, "right", "a", "human")


@pytest.mark.parametrize("verb", [get_query, lambda db, i: answer(db, i, "left", "a", "human")])
def test_unknown_question(db: Database, verb: Callable[[Database, int], object]) -> None:
    with pytest.raises(NotFound, match="no question 77"):
        verb(db, 77)


def test_database_itself_allows_one_standing_answer(db: Database, run: Run, guidance: int) -> None:
    answer(db, guidance, "left", "a", "human")

    def insert(client: str, standing: bool, choice: str = "left") -> None:
        with db.write() as session:
            row = Answer(query_id=guidance, run_id=run.id, number=int(client), choice=choice, parent="human")
            row.client_id, row.standing, row.received, row.supersedes = client, standing, db.clock(), 1
            session.add(row)

    with pytest.raises(IntegrityError, match=r"UNIQUE.*answer\.query_id|uq_answer_standing"):
        insert("2", standing=True)
    with pytest.raises(IntegrityError, match=r"(?i)CHECK.*choice"):
        insert("3", standing=False, choice="maybe")
    insert("4", standing=False)


def race(count: int, act: Callable[[int], object]) -> list[object]:
    """`act(i)` in `count` threads that start at one moment; what each gave back or raised."""
    results: list[object] = [None] * count
    gate = threading.Barrier(count)

    def runner(i: int) -> None:
        gate.wait()
        try:
            results[i] = act(i)
        except Conflict as error:
            results[i] = error

    threads = [threading.Thread(target=runner, args=(i,)) for i in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


def test_one_of_many_answers_wins(db: Database, mine: Claim) -> None:
    for tick in range(10):
        query = post_query(db, mine, tick, "guidance", 1, CLIPS)
        results = race(6, lambda i, query=query: answer(db, query, "left", f"client{i}", "human"))  # type: ignore[misc]
        assert sum(isinstance(result, answers.Stored) for result in results) == 1
        assert sum(isinstance(result, Conflict) for result in results) == 5
        assert count(db) == tick + 1


def test_one_answer_sent_many_times_at_once_is_stored_once(db: Database, guidance: int) -> None:
    results = race(8, lambda _: answer(db, guidance, "left", "a", "human"))
    assert len(set(results)) == 1
    assert isinstance(results[0], answers.Stored)
    assert count(db) == 1


def test_many_clients_lease_different_questions(db: Database, run: Run, mine: Claim) -> None:
    posted = {post_query(db, mine, tick, "preference", 1, CLIPS) for tick in range(4)}
    offered = race(6, lambda i: leased(db, run, f"client{i}"))
    assert sorted(map(str, offered)) == sorted(map(str, [*posted, None, None]))


def test_lease_writes_nothing_when_there_is_nothing(db: Database, run: Run) -> None:
    with db.write():  # the only turn to write is taken
        assert lease(db, run.id, "a") is None


def test_statuses_are_held_by_the_database(db: Database, guidance: int) -> None:
    with pytest.raises(IntegrityError, match=r"(?i)CHECK.*status"), db.write() as session:
        session.execute(text("UPDATE query SET status = 'lost' WHERE id = :id"), {"id": guidance})


def test_ahead_of_nothing_is_the_most_urgent_question(db: Database, run: Run, guidance: int) -> None:
    ahead = lease_ahead(db, run.id, "a", ())
    assert ahead is not None
    assert ahead.id == guidance
    assert lease_ahead(db, run.id, "a", (guidance,)) is None

"""Skips: clips are put back once and then withdrawn, guidance is set aside; neither counts as an answer."""

from __future__ import annotations

import httpx2
import pytest

from parenting.agent.query import Choice
from parenting.server import runs
from parenting.server.chain import check
from parenting.server.db import Database
from parenting.server.errors import Conflict, ElsewhereError, SetupError
from parenting.server.export import rows
from parenting.server.identity import database_id
from parenting.server.migrate import downgrade, upgrade
from parenting.server.new_run import start
from parenting.server.operator_events import add_operator_event
from parenting.server.queue import worker_side
from parenting.server.queue.answers import answer, get_query
from parenting.server.queue.corrections import take_correction
from parenting.server.queue.leases import lease
from parenting.server.queue.names import Names
from parenting.server.queue.revisions import supersede, withdraw
from parenting.server.queue.skips import skip
from parenting.server.queue.worker_side import post_query, take_answer, watch
from parenting.server.reads.schemas import run_schema
from parenting.server.reads.set_aside import set_aside
from parenting.server.runs import Claim, get_run, set_goal, set_status
from parenting.server.session import RunSession
from parenting.server.statuses import RunState, RunStatus
from parenting.server.verify import verify
from tests.server.conftest import CLIPS
from tests.server.raising import Begun

GUIDED = Begun("unsafe-exploration", "island", {"p_guid": 1.0, "p_pref": 0.0, "stages": 1})


@pytest.fixture
def clips(db: Database, mine: Claim) -> int:
    """An open preference, asked at tick 3."""
    return post_query(db, mine, 3, "preference", 1, CLIPS)


def leased(db: Database, mine: Claim, client: str = "a") -> int | None:
    query = lease(db, mine.run_id, client)
    return None if query is None else query.id


def counts(db: Database, mine: Claim) -> tuple[int, int, int]:
    """Rows, answers that stand, and skips."""
    now = run_schema(db, mine.run_id)
    return now.answers, now.standing, now.skipped


def test_clips_that_are_skipped_come_last_once_and_then_no_more(
    db: Database, mine: Claim, clips: int
) -> None:
    later = post_query(db, mine, 4, "preference", 1, CLIPS)
    assert leased(db, mine) == clips
    assert skip(db, clips, "a").outcome == "put_back"
    assert leased(db, mine, "b") == later, "all others come first"
    assert leased(db, mine) == clips
    assert skip(db, clips, "a").outcome == "withdrawn"
    assert get_query(db, clips).status == "withdrawn"
    assert take_answer(db, mine, 9) is None, "the agent hears nothing of it"
    assert counts(db, mine) == (2, 0, 2)


def test_a_skip_whose_reply_was_lost_may_be_sent_again(
    db: Database, mine: Claim, clips: int, guidance: int
) -> None:
    assert [skip(db, guidance, "a").number for _ in range(2)] == [1, 1]
    leased(db, mine)
    assert [skip(db, clips, "a").outcome for _ in range(3)] == ["put_back"] * 3
    assert counts(db, mine) == (2, 0, 2)


def test_skipped_guidance_is_heard_at_a_tick_and_counts_as_no_answer(
    db: Database, mine: Claim, guidance: int
) -> None:
    set_goal(db, mine.run_id, 1)
    found = skip(db, guidance, "a")
    assert (found.outcome, found.number) == ("set_aside", 1)
    assert watch(db, [mine.run_id])[mine.run_id].answers == 1, "it wakes the worker"
    taken = take_answer(db, mine, 6)
    assert taken is not None
    assert (taken.answer.choice, taken.answer.applied_tick, taken.query.status) == ("skip", 6, "applied")
    assert take_answer(db, mine, 6) is not None, "a replayed tick hears it again"
    assert not run_schema(db, mine.run_id).resting
    assert counts(db, mine) == (1, 0, 1)
    assert check(db, mine.run_id).problems == []


def test_a_skip_is_taken_back_like_an_answer(db: Database, mine: Claim, clips: int, guidance: int) -> None:
    skip(db, guidance, "a")
    assert withdraw(db, guidance, "a").outcome == "withdrawn"
    assert (get_query(db, guidance).status, leased(db, mine)) == ("open", guidance)
    answer(db, guidance, "left", "a", "human")
    for _ in range(2):
        leased(db, mine)
        skip(db, clips, "a")
    assert withdraw(db, clips, "a").outcome == "withdrawn"
    assert (get_query(db, clips).status, leased(db, mine)) == ("open", clips)
    assert counts(db, mine) == (4, 1, 1), "of the clips the first skip remains"
    assert withdraw(db, clips, "a").outcome == "withdrawn", "sent twice, it is taken back once"
    assert counts(db, mine) == (4, 1, 1)


def test_putting_back_is_taken_back_by_who_skipped(db: Database, mine: Claim, clips: int) -> None:
    leased(db, mine)
    skip(db, clips, "a")
    withdraw(db, clips, "b")
    assert get_query(db, clips).put_back
    for _ in range(2):
        withdraw(db, clips, "a")
    assert (get_query(db, clips).put_back, counts(db, mine)) == (False, (1, 0, 0))
    assert skip(db, clips, "a").outcome == "put_back"


def test_anybody_answers_what_was_skipped(db: Database, mine: Claim, clips: int, guidance: int) -> None:
    skip(db, guidance, "a")
    take_answer(db, mine, 6)
    with pytest.raises(Conflict, match="skipped"):
        answer(db, guidance, "left", "b", "human")
    assert supersede(db, guidance, "left", "b", "human").heard
    found = take_correction(db, mine, 7)
    assert found is not None
    assert (found.replaced.choice, found.answer.choice) == ("skip", "left")
    for _ in range(2):
        leased(db, mine)
        skip(db, clips, "a")
    assert not supersede(db, clips, "right", "b", "human").heard
    taken = take_answer(db, mine, 8)
    assert taken is not None
    assert taken.answer.choice == "right"
    assert counts(db, mine) == (5, 2, 1)


def test_what_was_answered_or_skipped_by_others_is_not_skipped(
    db: Database, mine: Claim, clips: int, guidance: int
) -> None:
    answer(db, clips, "left", "a", "human")
    skip(db, guidance, "a")
    with pytest.raises(Conflict, match="answered"):
        skip(db, clips, "a")
    with pytest.raises(Conflict, match="someone else"):
        skip(db, guidance, "b")
    with pytest.raises(ElsewhereError):
        skip(db, guidance, "a", names=Names(run="5J3mBbAH58CpQ3Y8RNJpUK"))


def test_a_resumed_run_asks_nothing_again_that_was_skipped_twice(
    db: Database, mine: Claim, clips: int, guidance: int
) -> None:
    answer(db, guidance, "left", "a", "human")
    for _ in range(2):
        leased(db, mine)
        skip(db, clips, "a")
    once = post_query(db, mine, 7, "preference", 1, CLIPS)
    leased(db, mine)
    skip(db, once, "a")
    set_status(db, mine.run_id, RunStatus.STOPPED)
    set_status(db, mine.run_id, RunStatus.ACTIVE)
    assert (get_query(db, clips).status, get_query(db, once).status) == ("withdrawn", "open")


def test_the_export_tells_of_every_skip(db: Database, mine: Claim, clips: int, guidance: int) -> None:
    skip(db, guidance, "a")
    leased(db, mine)
    skip(db, clips, "a")
    answer(db, clips, "left", "b", "human")
    told = [(row["choice"], row["mu"], row["standing"], row["supersedes"]) for row in rows(db, mine.run_id)]
    assert told == [("skip", None, True, None), ("skip", None, False, None), ("left", [1.0, 0.0], True, 2)]


def test_the_version_before_refuses_a_record_with_skips(db: Database, mine: Claim, guidance: int) -> None:
    downgrade(db, "0015")
    upgrade(db)
    skip(db, guidance, "a")
    with pytest.raises(SetupError, match="skipped"):
        downgrade(db, "0015")
    assert counts(db, mine) == (1, 0, 1)


def test_the_route_skips(client: httpx2.Client, db: Database, mine: Claim, guidance: int) -> None:
    name, run = get_query(db, guidance).public_id, get_run(db, mine.run_id).public_id
    named = {"client_id": "a", "database": database_id(db), "run": run, "question": name}
    at = f"/api/v1/queries/{name}/skip"
    assert (
        client.post(at, json={**named, "database": "7c9e6679-7425-40de-944b-e07fc1f90ae7"}).status_code == 410
    )
    reply = client.post(at, json=named).json()
    assert (reply["outcome"], reply["query_public_id"], reply["run_public_id"]) == ("set_aside", name, run)
    assert client.post(at, json={**named, "client_id": "b"}).status_code == 409
    assert client.get(f"/api/v1/queries/{name}").json()["answer"]["choice"] == "skip"


def raised(db: Database) -> RunSession:
    (mine,) = runs.claim(db, "worker", -1)
    return RunSession(db, mine, runs.get_run(db, mine.run_id), lambda: None)


def live(db: Database, life: RunSession) -> None:
    """Live on until the run waits."""
    seen = watch(db, [life.claim.run_id])
    while life.ready(seen[life.claim.run_id]):
        life.tick(seen[life.claim.run_id])
        seen = watch(db, [life.claim.run_id])
    life.report_waiting(seen[life.claim.run_id])


def test_a_run_whose_every_pair_was_skipped_is_unsure_until_one_is_answered(db: Database) -> None:
    """A worker that is killed on the way lives the same ticks again; the replay has the same bits."""
    run = start(db, GUIDED.new("human")).id
    life, skipped = raised(db), []
    live(db, life)
    while (query := lease(db, run, "a")) is not None:
        skipped.append(query.id)
        skip(db, query.id, "a")
        if len(skipped) == 3:
            life = raised(db)  # the worker before was killed
        live(db, life)
    assert len(skipped) == 6
    assert run_schema(db, run).state is RunState.UNSURE
    assert [query.id for query in set_aside(db, run)] == skipped
    life.save()
    supersede(db, skipped[2], "left", "b", "human")
    live(db, life)
    assert int(life.saved.state.world.step_count) == 1, "it has moved, and asks at the next place"
    assert run_schema(db, run).state is RunState.QUESTION
    assert set_aside(db, run) == []
    assert int(life.saved.tally.skips[0]) == 5
    assert int(life.saved.tally.choices[0, Choice.LEFT]) == 1
    life.save()
    found = verify(db, run)
    assert (found.x, found.chain.problems) == (None, [])
    assert found.replayed is not None
    assert found.replayed.equal


def test_an_episode_that_is_ended_takes_an_unsure_run_on(db: Database) -> None:
    run = start(db, GUIDED.new("human")).id
    life = raised(db)
    live(db, life)
    while (query := lease(db, run, "a")) is not None:
        skip(db, query.id, "a")
        live(db, life)
    add_operator_event(db, run, "end_episode", {"kind": "end_episode"})
    live(db, life)
    assert run_schema(db, run).state is RunState.QUESTION
    assert worker_side.high_water(db, run) == life.last_tick

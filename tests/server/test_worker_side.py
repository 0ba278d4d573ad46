"""The worker's verbs: posting, hearing, replaying, and the fence around them (C1 to C4)."""

import pytest

from parenting.server.db import Database
from parenting.server.errors import LostClaimError
from parenting.server.operator_events import add_operator_event
from parenting.server.progress import report_progress
from parenting.server.queue.answers import answer, get_query
from parenting.server.queue.corrections import take_correction, withdraw_guidance
from parenting.server.queue.queries import open_counts
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import (
    high_water,
    post_query,
    take_answer,
    take_operator_events,
    watch,
)
from parenting.server.runs import Claim, claim, get_run, set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import Run
from tests.server.conftest import CLIPS, Clock
from tests.server.heard import heard_answers


def answered(db: Database, mine: Claim, tick: int, kind: str = "preference") -> int:
    query = post_query(db, mine, tick, kind, 1, CLIPS)
    answer(db, query, "left", "a", "human")
    return query


def heard(db: Database, mine: Claim, tick: int) -> int | None:
    taken = take_answer(db, mine, tick)
    return None if taken is None else taken.query.id


def test_known_tick_is_not_asked_twice(db: Database, run: Run, mine: Claim, guidance: int) -> None:
    other = {"left": CLIPS["right"], "right": CLIPS["left"]}
    assert post_query(db, mine, 5, "preference", 2, other) == guidance
    kept = get_query(db, guidance)
    assert (kept.kind, kept.maturity, kept.clips) == ("guidance", 1, CLIPS)
    assert open_counts(db, run.id).guidance == 1


def test_open_means_not_yet_answered(db: Database, run: Run, mine: Claim) -> None:
    post_query(db, mine, 1, "preference", 1, CLIPS)
    answered(db, mine, 2)
    post_query(db, mine, 3, "guidance", 1, CLIPS)
    counts = open_counts(db, run.id)
    assert (counts.guidance, counts.preference) == (1, 1)


def test_guidance_is_heard_first_then_the_oldest_question(db: Database, mine: Claim) -> None:
    late, early = answered(db, mine, 4), answered(db, mine, 2)
    guidance = answered(db, mine, 6, "guidance")
    assert [heard(db, mine, tick) for tick in (7, 8, 9, 10)] == [guidance, early, late, None]


def test_heard_answer_is_marked_with_its_tick(db: Database, mine: Claim) -> None:
    query = answered(db, mine, 2)
    taken = take_answer(db, mine, 3)
    assert taken is not None
    assert (taken.answer.applied_tick, taken.query.status, taken.query.clips) == (3, "applied", CLIPS)
    assert get_query(db, query).status == "applied"
    assert [row.answer.applied_tick for row in heard_answers(db, mine.run_id)] == [3]


def test_replay_gives_back_what_was_recorded(db: Database, mine: Claim) -> None:
    first, second = answered(db, mine, 2), answered(db, mine, 3)
    assert [heard(db, mine, tick) for tick in (4, 5, 6)] == [first, second, None]
    later = answered(db, mine, 8)
    assert [heard(db, mine, tick) for tick in (3, 4, 5, 6, 7, 8)] == [None, first, second, None, None, None]
    assert heard(db, mine, 9) == later


def test_replay_gives_back_an_answer_that_was_superseded_later(db: Database, mine: Claim) -> None:
    query = answered(db, mine, 2)
    assert heard(db, mine, 3) == query
    supersede(db, query, "neither", "a", "human")
    taken = take_answer(db, mine, 3)
    assert taken is not None
    assert (taken.answer.choice, taken.answer.standing) == ("left", False)
    assert heard(db, mine, 4) is None, "a correction is heard as one, not as an answer"


def test_a_correction_has_a_tick_of_its_own(db: Database, mine: Claim) -> None:
    first, second = answered(db, mine, 2), answered(db, mine, 3)
    assert [heard(db, mine, tick) for tick in (4, 5)] == [first, second]
    supersede(db, first, "neither", "a", "human")
    assert watch(db, [mine.run_id])[mine.run_id].corrections == 1
    found = take_correction(db, mine, 6)
    assert found is not None
    assert (found.answer.choice, found.answer.applied_tick, found.replaced.choice) == ("neither", 6, "left")
    assert [taken.query.id for taken in found.standing] == [second, first]
    assert watch(db, [mine.run_id])[mine.run_id].corrections == 0
    again = take_correction(db, mine, 6)
    assert again is not None
    assert again.answer.id == found.answer.id, "a replayed tick hears it again"
    assert heard(db, mine, 6) is None
    assert take_correction(db, mine, 7) is None


def test_a_replayed_correction_leaves_what_was_asked_since(db: Database, mine: Claim) -> None:
    """Else a worker that was killed would leave an agent that waits for a question that nobody is asked."""
    post_query(db, mine, 2, "guidance", 1, CLIPS)
    later = post_query(db, mine, 6, "guidance", 1, CLIPS)
    withdraw_guidance(db, mine, 4)
    assert open_counts(db, mine.run_id).guidance == 1
    assert get_query(db, later).status == "open"


def test_correction_before_it_was_heard_is_what_is_heard(db: Database, mine: Claim) -> None:
    supersede(db, answered(db, mine, 2), "neither", "a", "human")
    taken = take_answer(db, mine, 3)
    assert taken is not None
    assert taken.answer.choice == "neither"


def test_posted_query_closes_its_tick_to_new_answers(db: Database, mine: Claim) -> None:
    query = answered(db, mine, 5)
    assert heard(db, mine, 5) is None, "the tick was lived before the answer came"
    assert heard(db, mine, 6) == query


@pytest.mark.parametrize(("posted", "expected"), [(None, -1), (7, 7)])
def test_high_water(db: Database, mine: Claim, posted: int | None, expected: int) -> None:
    if posted is not None:
        post_query(db, mine, posted, "guidance", 1, CLIPS)
    assert high_water(db, mine.run_id) == expected


def test_high_water_counts_answers_and_events(db: Database, mine: Claim) -> None:
    answered(db, mine, 1)
    heard(db, mine, 8)
    assert high_water(db, mine.run_id) == 8
    add_operator_event(db, mine.run_id, "mature", {})
    take_operator_events(db, mine, 11)
    assert high_water(db, mine.run_id) == 11


def test_events_apply_once_and_replay(db: Database, mine: Claim) -> None:
    add_operator_event(db, mine.run_id, "mature", {"kind": "mature"})
    change = {"kind": "change", "name": "p_rec", "value": 0.25}
    add_operator_event(db, mine.run_id, "change", change)
    assert [event.kind for event in take_operator_events(db, mine, 3)] == ["mature", "change"]
    assert take_operator_events(db, mine, 4) == []
    add_operator_event(db, mine.run_id, "mature", {})
    replayed = take_operator_events(db, mine, 3)
    assert [(event.applied_tick, event.kind) for event in replayed] == [(3, "mature"), (3, "change")]
    assert replayed[1].payload == change
    assert len(take_operator_events(db, mine, 5)) == 1


def test_events_and_answer_share_a_tick(db: Database, mine: Claim) -> None:
    query = answered(db, mine, 2)
    add_operator_event(db, mine.run_id, "mature", {})
    assert len(take_operator_events(db, mine, 3)) == 1
    assert heard(db, mine, 3) == query
    assert len(take_operator_events(db, mine, 3)) == 1
    assert heard(db, mine, 3) == query


def test_ended_episode_withdraws_guidance_and_nothing_else(db: Database, mine: Claim, guidance: int) -> None:
    preference = post_query(db, mine, 4, "preference", 1, CLIPS)
    add_operator_event(db, mine.run_id, "end_episode", {})
    take_operator_events(db, mine, 6)
    assert get_query(db, guidance).status == "withdrawn"
    assert get_query(db, preference).status == "open"


def test_stopping_a_run_withdraws_no_answered_query(db: Database, mine: Claim, guidance: int) -> None:
    done = answered(db, mine, 2)
    set_status(db, mine.run_id, RunStatus.STOPPED)
    assert (get_query(db, done).status, get_query(db, guidance).status) == ("answered", "withdrawn")


def test_question_of_a_stopped_run_is_never_open(db: Database, run: Run, mine: Claim) -> None:
    set_status(db, run.id, RunStatus.STOPPED)
    assert get_query(db, post_query(db, mine, 1, "guidance", 1, CLIPS)).status == "withdrawn"


def test_watch_tells_all_that_a_worker_waits_for(db: Database, run: Run, mine: Claim, guidance: int) -> None:
    post_query(db, mine, 6, "preference", 1, CLIPS)
    answered(db, mine, 7)
    add_operator_event(db, run.id, "mature", {})
    seen = watch(db, [run.id, 99])
    assert list(seen) == [run.id]
    found = seen[run.id]
    assert (found.status, found.worker, found.fencing_token) == ("active", mine.worker, mine.fencing_token)
    assert (found.open_guidance, found.open_preferences, found.answers, found.events) == (1, 1, 1, 1)


def test_worker_that_slept_past_its_claim_cannot_write(
    db: Database, run: Run, mine: Claim, clock: Clock
) -> None:
    query = answered(db, mine, 2)
    add_operator_event(db, run.id, "mature", {})
    clock.pass_seconds(6)
    (taker,) = claim(db, "worker-2")
    assert taker.fencing_token == mine.fencing_token + 1
    for write in (
        lambda: post_query(db, mine, 9, "guidance", 1, CLIPS),
        lambda: take_answer(db, mine, 9),
        lambda: take_operator_events(db, mine, 9),
        lambda: report_progress(db, mine, tick=9),
    ):
        with pytest.raises(LostClaimError, match="trained by worker-2"):
            write()
    assert get_run(db, run.id).tick == 0
    assert get_query(db, query).status == "answered"
    assert heard(db, taker, 9) == query

"""The order of turns: a person is never behind a script, and no run is passed over again and again."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any

import pytest

from parenting.server.queue.worker_side import Watch
from parenting.server.statuses import RunStatus
from parenting.server.work.schedule import (
    AT_LEISURE,
    AT_NEWS,
    LEISURE_SECONDS,
    NOW,
    OVERDUE_SECONDS,
    WRITE_SECONDS,
    Schedule,
)
from parenting.server.work.turns import LONG_AT_ONCE, QUICK_AT_ONCE, URGENT_AT_ONCE, Turns

BUSY = range(1, 41)
PERSON = 99


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    clock = [100.0]
    monkeypatch.setattr("parenting.server.work.schedule.time.monotonic", lambda: clock[0])
    return clock


def watch(run_id: int, answers: int = 1, person: bool = False, asked: int = 0) -> Watch:
    return Watch(run_id, RunStatus.ACTIVE, 1, "me", asked, 0, answers, 0, None, None, 0, 0, person)


def test_runs_that_are_always_due_have_their_turns_one_after_another(now: list[float]) -> None:
    """Where two turns are given at a time, forty busy runs have had as many each after any time."""
    schedule, given = Schedule(), dict.fromkeys(BUSY, 0)
    schedule.news({run_id: watch(run_id) for run_id in BUSY})
    for _ in range(200):
        now[0] += 0.01
        for run_id in schedule.due()[:2]:
            schedule.begin(run_id)
            given[run_id] += 1
            schedule.ended({run_id: NOW})
    assert set(given.values()) == {10}


def test_the_answer_of_a_person_goes_before_all_of_them(now: list[float]) -> None:
    schedule = Schedule()
    schedule.news({run_id: watch(run_id) for run_id in BUSY})
    now[0] += 10
    schedule.news({PERSON: watch(PERSON, person=True)})
    assert schedule.due()[0] == PERSON
    schedule.news({PERSON: watch(PERSON, answers=0, person=True)})
    assert schedule.due()[0] == PERSON, "its person waits for the next question"
    schedule.news({PERSON: watch(PERSON, answers=0, person=True, asked=1)})
    assert schedule.due()[-1] == PERSON, "nobody waits: it has its turn like the others"


def test_it_is_known_whether_people_wait_for_other_turns(now: list[float]) -> None:
    schedule = Schedule()
    schedule.news({1: watch(1), 2: watch(2, person=True), PERSON: watch(PERSON, person=True)})
    assert not schedule.people_wait(), "nobody has looked yet"
    first, second, script = schedule.due()
    schedule.begin(first)
    assert schedule.people_wait()
    schedule.begin(second)
    assert not schedule.people_wait()
    schedule.begin(script)
    assert not schedule.people_wait()
    schedule.due()
    assert not schedule.people_wait(), "their turns go on"


def test_people_do_not_keep_a_script_from_its_turns(now: list[float]) -> None:
    """Where a round is over after two turns, one of these is a script's after a second."""
    schedule, script, people = Schedule(), 1, range(2, 40)
    schedule.news({script: watch(script)})
    schedule.news({run_id: watch(run_id, person=True) for run_id in people})
    given = []
    for _ in range(40):
        now[0] += 0.1
        for run_id in schedule.due()[:2]:
            schedule.begin(run_id)
            schedule.ended({run_id: NOW})
            given.append(run_id)
    assert 3 <= given.count(script) <= 4
    assert len(set(given)) == 39


ASKED = watch(PERSON, answers=0, person=True, asked=1)


def at_leisure(schedule: Schedule) -> None:
    """A person's answer is heard, the next question is out, and rows are put off."""
    schedule.news({PERSON: watch(PERSON, person=True)})
    schedule.begin(PERSON)
    schedule.ended({PERSON: AT_LEISURE})
    schedule.news({PERSON: ASKED})  # of its own question


def turns_until(schedule: Schedule, now: list[float], seconds: int) -> list[int]:
    """Return the seconds in which that run was the second of all, while people wait for forty others."""
    found = []
    for second in range(1, seconds + 1):
        now[0] += 1
        schedule.news({run_id: watch(run_id, answers=second, person=True) for run_id in BUSY})
        first, second_of_all, *_ = schedule.due()
        assert first != PERSON
        if second_of_all == PERSON:
            found.append(second)
    return found


def test_what_is_only_written_down_keeps_nobody_waiting_for_six_seconds(now: list[float]) -> None:
    schedule = Schedule()
    at_leisure(schedule)
    assert schedule.waited() == 0.0
    assert min(turns_until(schedule, now, 9)) == LEISURE_SECONDS + OVERDUE_SECONDS + 1


def test_what_is_only_written_down_waits_for_the_next_answer(now: list[float]) -> None:
    """A person who answers within two seconds has one turn for both answers; else nobody need wait for it."""
    schedule = Schedule()
    at_leisure(schedule)
    assert schedule.due() == []
    assert schedule.soonest(9.0) == pytest.approx(WRITE_SECONDS)
    now[0] += WRITE_SECONDS
    assert schedule.due() == [PERSON]


@pytest.mark.parametrize("end", ["news", "a turn that goes on", "somebody else", "no room"])
def test_leisure_ends_with_what_others_wait_for(now: list[float], end: str) -> None:
    """It is due like any other then, however often that is said again."""
    schedule = Schedule()
    at_leisure(schedule)
    if end == "news":
        schedule.news({PERSON: watch(PERSON, answers=0, asked=1)})
    if end == "a turn that goes on":  # such as one that replays its record
        schedule.begin(PERSON)
        schedule.ended({PERSON: NOW})
    for _ in range(3):
        if end == "somebody else":
            schedule.hurry([PERSON])
        if end == "no room":
            schedule.end_leisure()
        now[0] += 0.3
    assert schedule.waited() == pytest.approx(0.9)
    assert min(turns_until(schedule, now, 3)) == 1


def test_a_run_has_not_waited_while_its_own_turn_went_on(now: list[float]) -> None:
    schedule = Schedule()
    schedule.news({1: watch(1)})
    schedule.begin(1)
    now[0] += 0.1
    schedule.news({1: watch(1, answers=0)})  # of what its turn has stored
    now[0] += 1.4
    assert schedule.ended({1: NOW})
    assert schedule.waited() == 0
    now[0] += 0.2
    assert schedule.waited() == pytest.approx(0.2)


def test_news_of_a_run_that_is_due_do_not_put_it_behind_others(now: list[float]) -> None:
    schedule = Schedule()
    schedule.news({1: watch(1)})
    now[0] += 1
    schedule.news({2: watch(2)})
    now[0] += 1
    schedule.news({1: watch(1, answers=2)})
    assert schedule.due() == [1, 2]
    assert schedule.waited() == 2


@pytest.mark.parametrize("status", [RunStatus.ACTIVE, RunStatus.PAUSED, RunStatus.STOPPED])
@pytest.mark.parametrize("news", ["answers", "corrections", "events", None])
def test_only_a_run_with_nothing_new_for_its_agent_is_at_leisure(status: RunStatus, news: str | None) -> None:
    asked = replace(watch(1, answers=0, person=True, asked=1), status=status)
    new: dict[str, Any] = {news: 1} if news else {}
    seen = replace(asked, **new)
    assert seen.at_leisure == (status is RunStatus.ACTIVE and news is None)
    assert not replace(seen, person=False).at_leisure, "a script answers at once"
    assert not replace(seen, open_guidance=0, open_preferences=1).at_leisure, "the agent may go on"


def test_it_tells_how_long_turns_have_waited(now: list[float]) -> None:
    schedule = Schedule()
    schedule.news({1: watch(1), 2: watch(2)})
    now[0] += 0.2
    schedule.begin(1)
    schedule.ended({1: AT_NEWS})
    now[0] += 0.3
    assert schedule.waited() == pytest.approx(0.5), "run 2 still waits"
    schedule.begin(2)
    schedule.ended({2: AT_NEWS})
    now[0] += 9
    assert schedule.waited() == pytest.approx(0.5), "it had begun after half a second"
    assert schedule.waited() == 0, "at rest nothing waits"


def test_a_person_finds_a_thread_whatever_the_others_do() -> None:
    turns, gate = Turns(lambda: None, beside_after=0.0), threading.Event()

    def held() -> float:
        gate.wait(30)
        return AT_NEWS

    try:
        for number in range(QUICK_AT_ONCE):
            assert turns.may_begin(number, new=number < LONG_AT_ONCE)
            turns.begin(number, held)
            if number + 1 == LONG_AT_ONCE:
                assert not turns.may_begin(50, new=True), "more would take the processor from quick ones"
        assert not turns.may_begin(50, new=False)
        assert turns.may_begin(PERSON, new=True, urgent=True)
        assert not turns.may_begin(1, new=False, urgent=True), "a run has one turn at a time"
        assert turns._pool._max_workers == URGENT_AT_ONCE
    finally:
        gate.set()
        turns.close(5)
    assert turns.may_begin(50, new=True), "what has ended takes no thread"

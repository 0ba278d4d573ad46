"""The order of turns: a person is never behind a script, and no run is passed over again and again."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any

import pytest

from parenting.server.queue.worker_side import Watch
from parenting.server.statuses import RunStatus
from parenting.server.work.schedule import AT_NEWS, LEISURE_SECONDS, NOW, OVERDUE_SECONDS, Schedule
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


def test_what_is_only_written_down_keeps_nobody_waiting_for_five_seconds(now: list[float]) -> None:
    """A run whose person has guidance to give is passed over while people wait for other runs."""
    schedule, done = Schedule(), 99
    schedule.news({done: watch(done, answers=0, person=True, asked=1)})
    assert schedule.due() == [done], "nobody waits for another one"
    assert schedule.waited() == 0.0
    for second in range(1, 10):
        now[0] += 1
        schedule.news({run_id: watch(run_id, person=True) for run_id in BUSY})
        first, second_of_all, *_ = schedule.due()
        assert first != done
        assert (second_of_all == done) == (second > LEISURE_SECONDS + OVERDUE_SECONDS)
        for run_id in BUSY:
            schedule.begin(run_id)
            schedule.ended({run_id: AT_NEWS})
            schedule.news({run_id: watch(run_id, answers=0, person=True, asked=1)})
            schedule.begin(run_id)
            schedule.ended({run_id: AT_NEWS})
    schedule.hurry([done])
    assert schedule.due() == [done]


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

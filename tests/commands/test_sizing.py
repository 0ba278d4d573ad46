"""`parenting up --workers auto` starts a worker where runs wait, and ends one that is not needed."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable

import pytest
from typer import BadParameter

from parenting.commands import following, sizing
from parenting.commands.children import Process, stop
from parenting.commands.crew import Crew
from parenting.commands.sizing import Sizing
from parenting.commands.up import _number
from parenting.server.db import Database
from parenting.server.workers import Figures, new_name, sign

WAITING, BUSY, IDLE = (
    Figures(waited=0.3, busy=1.0),
    Figures(waited=0.02, busy=0.9),
    Figures(waited=0.0, busy=0.0),
)


def over(rule: Sizing, seconds: float, said: Figures, since: float = 0.0) -> list[int]:
    """The numbers of workers, second by second, while each says the same."""
    return [rule.look([said] * rule.number, since + second) for second in range(int(seconds))]


def test_one_more_starts_where_runs_wait_up_to_the_most() -> None:
    numbers = over(Sizing(3), 60, WAITING)
    assert numbers[0] == 1
    assert numbers == sorted(numbers)
    assert numbers[-1] == 3
    assert {2, 3} <= set(numbers), "they come one by one, and the next once the last has settled"
    assert numbers.count(2) >= sizing.SETTLES_SECONDS


def test_a_burst_starts_none() -> None:
    rule = Sizing(3)
    for second in range(60):
        rule.look([WAITING if second % 2 else BUSY], float(second))
    assert rule.number == 1


def test_an_idle_one_ends_after_a_minute_and_never_the_last() -> None:
    rule = Sizing(2)
    over(rule, 10, WAITING)
    assert rule.number == 2
    numbers = over(rule, 3 * sizing.IDLE_SECONDS, IDLE, since=10)
    assert numbers[: int(sizing.IDLE_SECONDS) - 1] == [2] * (int(sizing.IDLE_SECONDS) - 1)
    assert numbers[-1] == 1


def test_none_ends_that_the_others_could_not_stand_in_for() -> None:
    rule = Sizing(2)
    over(rule, 10, WAITING)
    assert set(over(rule, 3 * sizing.IDLE_SECONDS, BUSY, since=10)) == {2}


def test_there_is_a_core_for_the_web(monkeypatch: pytest.MonkeyPatch) -> None:
    for cores, most in ((1, 1), (2, 1), (8, 7)):
        monkeypatch.setattr("os.sched_getaffinity", lambda _pid, n=cores: set(range(n)), raising=False)
        assert sizing.most_workers() == most


@pytest.mark.parametrize("workers", ["0", "many", "-1", "65", "1.5", ""])
def test_another_word_is_refused_with_its_remedy(workers: str) -> None:
    with pytest.raises(BadParameter, match="neither auto nor a number from 1 to 64"):
        _number(workers)


def sleeper() -> Process:
    return subprocess.Popen([sys.executable, "-S", "-c", "import time; time.sleep(60)"])


def until(met: Callable[[], bool], crew: Crew) -> None:
    end = time.monotonic() + 20
    while not met():
        assert time.monotonic() < end
        crew.look()
        time.sleep(0.01)


def test_a_crew_grows_shrinks_and_leaves_no_process_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    crew = Crew(sleeper, said.append)
    try:
        first = crew.children[0]
        crew.wanted = 2
        crew.look()
        second = crew.children[1]
        assert first.process.poll() is second.process.poll() is None
        crew.wanted = 1
        crew.look()
        assert crew.children == [first]
        assert crew.all() == [first, second], "one that is just ending is stopped with the others"
        until(lambda: crew.all() == [first], crew)
        assert second.process.returncode is not None
        assert said == [
            "Runs wait for their turns, so one more worker starts: 2 workers from now on.",
            "The workers have little to do, so one of them ends: 1 worker from now on.",
        ]
    finally:
        stop(crew.all())


def test_where_no_process_is_left_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    crew = Crew(sleeper, said.append)

    def refused() -> Process:
        raise OSError(11, "Resource temporarily unavailable")

    try:
        monkeypatch.setattr(crew, "_start", refused)
        crew.wanted = 2
        for _ in range(3):
            crew.look()
        assert said == ["One more worker cannot be started (Resource temporarily unavailable)."]
        assert len(crew.children) == 1
    finally:
        stop(crew.all())


def test_the_crew_follows_what_its_own_workers_say(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers of another machine, or of another `up`, are not counted."""
    monkeypatch.setattr(following, "LOOK_SECONDS", 0.0)
    crew = Crew(sleeper, lambda _: None)
    heard: list[list[Figures]] = []
    ended = threading.Event()

    class Rule(Sizing):
        def look(self, said: list[Figures], now: float) -> int:  # type: ignore[override]
            heard.append(list(said))
            ended.set()
            return 2

    try:
        pid = crew.children[0].process.pid
        sign(db, new_name(pid), WAITING)
        sign(db, new_name(1), BUSY)
        sign(db, new_name(10 * pid), BUSY)
        sign(db, f"elsewhere:{pid}", BUSY)
        following.follow_load(crew, db, Rule(2), ended)
        assert heard == [[WAITING]]
        assert crew.wanted == 2
    finally:
        stop(crew.all())

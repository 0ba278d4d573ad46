"""Long work stands back while a person waits for a quick run, and never for good."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from parenting.envs.giving_way import give_way
from parenting.server.work import courtesy, turns
from parenting.server.work.courtesy import Courtesy
from parenting.server.work.turns import Turns

PERSON, LARGE = 1, 2
PATIENCE = 30.0


@contextmanager
def long_work(some: Courtesy, run_id: int | None = LARGE) -> Iterator[threading.Event]:
    """A thread that comes to a point where it gives way; the event is set once it has gone on."""
    gone_on = threading.Event()

    def work() -> None:
        with some.turn(run_id, hurried=False):
            give_way()
        gone_on.set()

    thread = threading.Thread(target=work)
    thread.start()
    yield gone_on
    thread.join(PATIENCE)


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """No point holds long work up for a short time only, turns stay quick, and all work counts as long."""
    monkeypatch.setattr(courtesy, "LONG_SECONDS", 0.0)
    monkeypatch.setattr(courtesy, "LONGEST_WAIT", PATIENCE)
    monkeypatch.setattr(courtesy, "QUICK_SECONDS", PATIENCE)


@pytest.mark.usefixtures("patient")
@pytest.mark.parametrize("run_id", [LARGE, None])
def test_long_work_stands_back_until_the_hurried_turn_has_ended(run_id: int | None) -> None:
    some = Courtesy()
    with some.turn(PERSON, hurried=True), long_work(some, run_id) as gone_on:
        assert not gone_on.wait(0.05)
        some.ended(PERSON)
        assert gone_on.wait(PATIENCE)


@pytest.mark.usefixtures("patient")
def test_a_hurried_turn_does_not_stand_back_for_another() -> None:
    some = Courtesy()
    with some.turn(PERSON, hurried=True), some.turn(LARGE, hurried=True):
        give_way()  # it would wait for half a minute


@pytest.mark.usefixtures("patient")
def test_a_turn_that_is_not_hurried_holds_nobody_up() -> None:
    some = Courtesy()
    with some.turn(PERSON, hurried=False), long_work(some) as gone_on:
        assert gone_on.wait(PATIENCE)


@pytest.mark.parametrize("name", ["LONGEST_WAIT", "QUICK_SECONDS"])
@pytest.mark.usefixtures("patient")
def test_long_work_goes_on_though_a_hurried_turn_does_not_end(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Each point waits for a short time, and a turn counts as a quick one for a short time."""
    monkeypatch.setattr(courtesy, name, 0.0)
    some = Courtesy()
    with some.turn(PERSON, hurried=True), long_work(some) as gone_on:
        assert gone_on.wait(PATIENCE)


@pytest.mark.usefixtures("patient")
def test_work_that_has_just_begun_stands_back_for_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(courtesy, "LONG_SECONDS", PATIENCE)
    some = Courtesy()
    with some.turn(PERSON, hurried=True), long_work(some) as gone_on:
        assert gone_on.wait(PATIENCE / 2)


@pytest.mark.usefixtures("patient")
def test_work_stands_back_no_longer_than_it_has_worked(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first wait is longer than the work before it, so the second point holds nothing up."""
    monkeypatch.setattr(courtesy, "LONGEST_WAIT", 0.5)
    some, waits = Courtesy(), list[bool]()
    stands_back = some._stands_back

    def noted(run_id: int | None) -> bool:
        waits.append(True)
        return stands_back(run_id)

    monkeypatch.setattr(some, "_stands_back", noted)
    with some.turn(PERSON, hurried=True), some.turn(None, hurried=False):
        give_way()
        seen = len(waits)
        give_way()
    assert seen > 0
    assert len(waits) == seen


def test_the_lock_changes_hands_as_before_once_nobody_hurries() -> None:
    some, usual = Courtesy(), sys.getswitchinterval()
    with some.turn(PERSON, hurried=True):
        with some.turn(LARGE, hurried=True):
            assert sys.getswitchinterval() == pytest.approx(courtesy.SWITCH_SECONDS)
        assert sys.getswitchinterval() == pytest.approx(courtesy.SWITCH_SECONDS)
    assert sys.getswitchinterval() == usual


def test_left_alone_nothing_happens_where_others_could_go_first() -> None:
    with Courtesy().turn(PERSON, hurried=False):
        pass
    give_way()


@pytest.mark.parametrize(
    ("urgent", "last_took", "hurried"), [(True, 0.0, True), (False, 0.0, False), (True, 9.0, False)]
)
def test_a_turn_is_hurried_if_a_person_waits_and_the_last_was_not_slow(
    monkeypatch: pytest.MonkeyPatch, urgent: bool, last_took: float, hurried: bool
) -> None:
    some, asked = Turns(lambda: None, beside_after=None), list[bool]()
    some.begin(PERSON, lambda: 0.0)
    monkeypatch.setattr(turns, "SLOW_SECONDS", PATIENCE if last_took == 0 else 0.0)
    some.ended()
    turn = some.courtesy.turn

    @contextmanager
    def noted(run_id: int | None, hurried: bool) -> Iterator[None]:
        asked.append(hurried)
        with turn(run_id, hurried):
            yield

    monkeypatch.setattr(some.courtesy, "turn", noted)
    some.begin(PERSON, lambda: 0.0, urgent)
    assert asked == [hurried]
    some.close(0)

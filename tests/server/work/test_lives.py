"""Lives that wait leave memory, and come back as they were once something is new for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import pytest
from sqlalchemy import select

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.errors import BusyError
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.queue.revisions import supersede, withdraw
from parenting.server.queue.skips import skip
from parenting.server.queue.worker_side import look, post_query
from parenting.server.runs import Claim, claim, get_run, let_go, set_goal, set_pace, set_status
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.tables import Query
from parenting.server.work.lives import Lives
from parenting.server.work.watching import Watching
from parenting.server.worker import Worker
from tests.server.conftest import CLIPS

ANSWERS = 2


@pytest.fixture(autouse=True)
def brisk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Checkpoints follow each tick, so that a run that waits is at rest at once."""
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 0.0)
    monkeypatch.setattr("parenting.server.checkpoint_pace.QUIET_SECONDS", 0.0)
    monkeypatch.setattr("parenting.server.checkpoint_pace.QUIET_EACH", 0.0)
    monkeypatch.setattr("parenting.server.why.WRITE_SECONDS", 0.0)


def begin(db: Database, number: int) -> list[int]:
    new = NewRun(world="unsafe-exploration", parent="human", seed=3, config={"p_pref": 0.0})
    return [start(db, new).id for _ in range(number)]


def few(settings: Settings, most: int = 1) -> Settings:
    return settings.model_copy(update={"lives": most})


def rounds(worker: Worker, met: Callable[[], bool]) -> None:
    """Do as the worker's loop does, until something holds."""
    for _ in range(400):
        if met():
            return
        worker._go_on()
    raise AssertionError("it does not come to that")


def asked(db: Database, run: int) -> list[tuple[Any, ...]]:
    """The questions of a run, by their ticks."""
    with db.read() as session:
        rows = select(Query.tick, Query.kind, Query.clips).where(Query.run_id == run).order_by(Query.tick)
        return [tuple(row) for row in session.execute(rows)]


def raise_them(db: Database, worker: Worker, runs: list[int]) -> None:
    """Answer the questions of some runs in turn, each once its agent has asked."""
    for number in range(1, ANSWERS + 1):
        rounds(worker, lambda: all(look(db, [run])[run].open_guidance for run in runs))
        for run in runs:
            found = lease(db, run, "me")
            assert found is not None
            answer(db, found.id, "either", "me", "human")
            rounds(worker, lambda: len(asked(db, run)) > number)  # noqa: B023


def test_lives_that_come_back_go_on_as_if_they_had_never_left(db: Database, settings: Settings) -> None:
    (stayed,) = begin(db, 1)
    worker = Worker(db, settings)
    raise_them(db, worker, [stayed])
    worker._close()
    set_status(db, stayed, RunStatus.STOPPED)
    runs = begin(db, 3)
    worker = Worker(db, few(settings))
    raise_them(db, worker, runs)
    rounds(worker, lambda: len(worker.sessions) == 1)
    assert set(worker.claims) == set(runs), "they leave memory, not the worker"
    assert all(asked(db, run) == asked(db, stayed) for run in runs)
    worker._close()


@pytest.mark.slow
def test_runs_that_wait_are_not_taken_up_beyond_what_memory_should_hold(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run whose record goes beyond its last checkpoint is: it has ticks to repeat."""
    runs, worker = begin(db, 4), Worker(db, settings)
    raise_them(db, worker, runs)
    rounds(worker, lambda: len(worker.schedule.at_rest()) == len(runs))
    worker._close()
    with db.write() as session:
        late = session.scalars(select(Query).where(Query.run_id == runs[3]).order_by(Query.tick)).all()[-1]
        late.tick += 1
    taken: list[int] = []
    take_up = RunSession.__init__

    def noted(self: RunSession, db: Database, mine: Claim, *more: Any) -> None:
        taken.append(mine.run_id)
        take_up(self, db, mine, *more)

    monkeypatch.setattr(RunSession, "__init__", noted)
    worker = Worker(db, few(settings))
    for _ in range(5):
        worker._go_on()
    assert taken == [runs[0], runs[3]]
    worker._close()


@pytest.mark.slow
def test_the_least_recently_used_life_leaves_first(db: Database, settings: Settings) -> None:
    runs, worker = begin(db, 3), Worker(db, few(settings, 2))
    rounds(worker, lambda: all(look(db, [run])[run].open_guidance for run in runs))
    for run in (runs[1], runs[0], runs[2]):
        raise_them(db, worker, [run])
        rounds(worker, lambda: worker.sessions.keys() <= set(worker.schedule.at_rest()))
    assert len(worker.sessions) == 2
    assert set(worker.sessions) == {runs[0], runs[2]}
    worker._close()


@pytest.mark.slow
def test_lives_leave_before_their_next_checkpoint_is_due(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a thousand runs that have just asked would all be in memory until each has saved."""
    for name in ("CHECKPOINT_SECONDS", "QUIET_SECONDS", "QUIET_EACH"):
        monkeypatch.setattr(f"parenting.server.checkpoint_pace.{name}", 3600.0)
    runs, worker = begin(db, 3), Worker(db, few(settings, 1))
    rounds(worker, lambda: all(look(db, [run])[run].open_guidance for run in runs))
    rounds(worker, lambda: len(worker.sessions) == 1)
    worker._close()


@pytest.mark.slow
@pytest.mark.only("sqlite", "no statement of the store is new in it")
def test_runs_that_begin_wait_until_others_have_left_memory(db: Database, settings: Settings) -> None:
    """Else all would be there for a moment, and that memory is not given back."""
    runs, worker, most = begin(db, 7), Worker(db, few(settings, 2)), 0

    def all_asked() -> bool:
        nonlocal most
        most = max(most, len(worker.sessions))
        return all(look(db, [run])[run].open_guidance for run in runs)

    rounds(worker, all_asked)
    assert 2 <= most <= 4
    worker._close()


@pytest.mark.slow
@pytest.mark.only("sqlite", "no statement of the store is new in it")
def test_runs_that_cannot_leave_hold_up_no_other(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Lives, "guided", lambda lives: set())
    monkeypatch.setattr("parenting.server.work.schedule.Schedule.at_rest", lambda schedule: [])
    runs, worker = begin(db, 4), Worker(db, few(settings, 1))
    rounds(worker, lambda: all(look(db, [run])[run].open_guidance for run in runs))
    assert set(worker.sessions) == set(runs)
    worker._close()


@pytest.mark.slow
def test_a_run_that_sleeps_comes_for_an_event_though_memory_is_full(db: Database, settings: Settings) -> None:
    runs, worker = begin(db, 2), Worker(db, few(settings, 1))
    rounds(worker, lambda: all(look(db, [run])[run].open_guidance for run in runs))
    rounds(worker, lambda: len(worker.sessions) == 1 and len(worker.held.lives.asleep) == 1)
    (asleep,) = worker.held.lives.asleep
    add_operator_event(db, asleep, "end_episode", {"kind": "end_episode"})
    rounds(worker, lambda: not look(db, [asleep])[asleep].events)
    worker._close()


def test_a_life_with_an_answer_to_hear_stays(db: Database, settings: Settings) -> None:
    """It waits for its turn. Put to rest, it would hear the answer only after some other news."""
    (run,) = begin(db, 1)
    worker = Worker(db, settings)
    rounds(worker, lambda: look(db, [run])[run].open_guidance > 0 and worker.held.lives.guided() == {run})
    found = lease(db, run, "me")
    assert found is not None
    answer(db, found.id, "either", "me", "human")
    worker.held.lives.most = 0
    worker._look()
    worker._make_room()
    worker._end_turns()
    assert set(worker.sessions) == {run}
    rounds(worker, lambda: len(asked(db, run)) > 1)
    worker._close()


def test_every_deed_of_a_parent_or_an_operator_is_news(db: Database) -> None:
    """The one statement that watches over all runs misses nothing that a look at each would show."""
    (run, other) = begin(db, 2)
    claims = {mine.run_id: mine for mine in claim(db, "me")}
    watching = Watching(db)
    one = post_query(db, claims[run], 1, "guidance", 1, CLIPS)
    two = post_query(db, claims[run], 2, "preference", 1, CLIPS)
    assert set(watching.look("me", claims).found) == {run, other}
    deeds: list[Callable[[], Any]] = [
        lambda: answer(db, one, "left", "a", "human"),
        lambda: withdraw(db, one, "a"),
        lambda: answer(db, one, "right", "a", "human"),
        lambda: supersede(db, one, "left", "a", "human"),
        lambda: skip(db, two, "a", "human"),
        lambda: add_operator_event(db, run, "change", {"kind": "change", "name": "p_guid", "value": 0.5}),
        lambda: set_goal(db, run, 5),
        lambda: set_pace(db, run, 2.0),
        lambda: set_status(db, run, RunStatus.PAUSED),
        lambda: set_status(db, run, RunStatus.ACTIVE),
    ]
    for deed in deeds:
        deed()
        news = watching.look("me", claims)
        assert news.found == look(db, [run])
        assert watching.look("me", claims) is news, "nobody has committed since"
    set_status(db, run, RunStatus.STOPPED)
    assert watching.look("me", claims).found[run].status is RunStatus.STOPPED


def test_what_is_lost_and_what_nobody_told_of_is_seen(db: Database) -> None:
    lost, kept, untold = begin(db, 3)
    mine = {one.run_id: one for one in claim(db, "me")}
    let_go(db, [mine[lost]])
    known = {run_id: one for run_id, one in mine.items() if run_id != untold}
    news = Watching(db).look("me", known)
    assert set(news.lost) == {lost}
    assert list(news.unknown) == [mine[untold]]
    assert set(news.found) == {kept}


def test_news_come_through_a_store_that_refuses_once(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Runs that nobody told it of are given back at the next look, and what was seen beside them counts."""
    worker = Worker(db, settings)
    kept, untold = begin(db, 2)
    mine = {one.run_id: one for one in claim(db, worker.name)}
    worker.claims[kept] = mine[kept]
    refusals = iter([BusyError()])

    def refused(at: Database, claims: Sequence[Claim]) -> None:
        if (error := next(refusals, None)) is not None:
            raise error
        let_go(at, claims)

    monkeypatch.setattr(runs, "let_go", refused)
    with pytest.raises(BusyError):
        worker._look()
    assert kept in worker.schedule.seen
    worker._look()
    assert get_run(db, untold).worker is None
    worker._close()

"""Pieces are stored whole, belong to one plan, and are never done twice; workers may die."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import pytest

from experiments.labour import TRIES, WorkersDied, work
from experiments.pieces import OtherPlan, Row, Store, Task

PLAN = {"experiment": "sums", "seed": 0}


def add(first: int, second: int) -> list[Row]:
    """A piece of work."""
    return [{"sum": first + second}]


def die_once(mark: str) -> list[Row]:
    """Killed at the first try, as for want of memory."""
    if not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return [{"sum": 0}]


def die() -> list[Row]:
    """Killed each time."""
    os.kill(os.getpid(), signal.SIGKILL)
    return []


def refuse(first: int, second: int) -> list[Row]:
    """What is done already is not to be done again."""
    raise AssertionError("done twice")


def double(given: list[Row], and_: int) -> list[Row]:
    """What is done with the rows of other pieces."""
    return [{"sum": 2 * row["sum"] + and_, "_of": row["_blob"]} for row in given]


def heavy(first: int) -> list[Row]:
    """A row with something that only other pieces are to see."""
    return [{"sum": first, "_blob": "x" * first}]


def task(first: int, call: str = "add") -> Task:
    return Task(f"piece-{first}", f"{__name__}:{call}", {"first": first, "second": 1})


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "pieces", PLAN)


@pytest.fixture
def importable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Worker processes find this module by its name."""
    root = Path(__file__).parents[2]
    monkeypatch.setenv("PYTHONPATH", str(root))


def test_rows_come_in_the_order_of_the_tasks(store: Store) -> None:
    assert work([task(3), task(1), task(2)], store, 1) == [{"sum": 4}, {"sum": 2}, {"sum": 3}]


def test_what_is_done_is_not_done_again(store: Store) -> None:
    work([task(1), task(2)], store, 1)
    told: list[str] = []
    rows = work(
        [task(1, "refuse"), task(2, "refuse"), task(5)], store, 1, told=lambda one: told.append(one.key)
    )
    assert rows == [{"sum": 2}, {"sum": 3}, {"sum": 6}]
    assert told == ["piece-1", "piece-2", "piece-5"]


def test_what_a_piece_needs_is_done_before_and_given_to_it(store: Store) -> None:
    """Named later and cheaper, it still comes first; what is hidden comes to the other piece alone."""
    both = Task("both", f"{__name__}:double", {"and_": 1}, share=9, needs=("one", "two"))
    needed = [Task(key, f"{__name__}:heavy", {"first": n}) for key, n in (("two", 2), ("one", 1))]
    assert work([both, *needed], store, 1) == [{"sum": 3}, {"sum": 5}, {"sum": 2}, {"sum": 1}]
    assert store.find(both) == [{"sum": 3, "_of": "x"}, {"sum": 5, "_of": "xx"}]


def test_a_need_that_no_task_makes_is_loud(store: Store) -> None:
    alone = task(1)._replace(needs=("nowhere",))
    with pytest.raises(FileNotFoundError, match=r"piece-1\.json"):
        work([alone], store, 1)


def test_a_piece_that_was_not_renamed_is_no_piece(store: Store) -> None:
    (store.folder / ".piece-1.json.99").write_text('[{"sum": 9')
    assert store.find(task(1)) is None


def test_the_time_of_all_runs_counts(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.pieces.monotonic", iter((0.0, 5.0, 100.0, 107.0)).__next__)
    for first in (1, 2):
        Store(store.folder, PLAN).keep(task(first), [])
    assert store.seconds() == 12


def test_another_plan_is_refused(store: Store) -> None:
    Store(store.folder, PLAN)
    with pytest.raises(OtherPlan, match=r"seed was 0 and is 1 now\. Name another folder by --out"):
        Store(store.folder, {**PLAN, "seed": 1})


def test_numbers_that_are_none_are_refused(store: Store) -> None:
    with pytest.raises(ValueError, match="JSON"):
        store.keep(task(1), [{"sum": float("nan")}])
    assert store.find(task(1)) is None
    assert json.loads((store.folder / "plan.json").read_text()) == PLAN


@pytest.mark.usefixtures("importable")
def test_processes_do_the_same(store: Store) -> None:
    """One of them waits for another."""
    both = Task("both", f"{__name__}:double", {"and_": 1}, needs=("two", "three"))
    needed = [Task(key, f"{__name__}:heavy", {"first": n}) for key, n in (("two", 2), ("three", 3))]
    rows = work([both, task(4), *needed], store, 2)
    assert rows == [{"sum": 5}, {"sum": 7}, {"sum": 5}, {"sum": 2}, {"sum": 3}]


@pytest.mark.usefixtures("importable")
def test_a_worker_that_dies_costs_its_piece_only(store: Store, tmp_path: Path) -> None:
    fatal = Task("fatal", f"{__name__}:die_once", {"mark": str(tmp_path / "mark")})
    rows = work([task(1), fatal, task(2)], store, 2)
    assert rows == [{"sum": 2}, {"sum": 0}, {"sum": 3}]


@pytest.mark.usefixtures("importable")
def test_workers_that_always_die_are_said_and_all_else_is_done(store: Store) -> None:
    fatal = Task("fatal", f"{__name__}:die", {})
    needy = Task("needy", f"{__name__}:double", {"and_": 1}, needs=("fatal",))
    with pytest.raises(WorkersDied, match=rf"died {TRIES} times over fatal\..*fewer workers"):
        work([fatal, needy, *(task(number) for number in range(2))], store, 2)
    assert [store.find(task(number)) for number in range(2)] == [[{"sum": n + 1}] for n in range(2)]
    assert not store.has("fatal")
    assert not store.has("needy")

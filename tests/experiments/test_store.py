"""Pieces are stored whole, belong to one plan, and are never done twice; workers may die."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import pytest

from parenting.agent.config import Config
from parenting.experiments.runner import provenance
from parenting.experiments.runner.aliases import LATER
from parenting.experiments.runner.executor import TRIES, work
from parenting.experiments.runner.processes import WorkersDiedError
from parenting.experiments.runner.store import PlanMismatchError, Row, Store, Task

PLAN = {"experiment": "sums", "seed": 0, "presets": {"lax": {"p_guid": 0.5, "p_rec": 0.5}}}


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


def add_and_mark(first: int, mark: str) -> list[Row]:
    """A piece of work that leaves a line for each time that it is done."""
    with Path(mark).open("a") as file:
        file.write(f"{first}\n")
    return [{"sum": first + 1}]


def double(given: list[Row], and_: int) -> list[Row]:
    """The use of the rows of other pieces."""
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


def marking(first: int, mark: Path) -> Task:
    return Task(f"piece-{first}", f"{__name__}:add_and_mark", {"first": first, "mark": str(mark)})


def test_what_is_done_is_not_done_again(store: Store, tmp_path: Path) -> None:
    tasks = [marking(first, tmp_path / "mark") for first in (1, 2, 5)]
    work(tasks[:2], store, 1)
    on_done: list[str] = []
    rows = work(tasks, store, 1, on_done=lambda one: on_done.append(one.key))
    assert rows == [{"sum": 2}, {"sum": 3}, {"sum": 6}]
    assert on_done == ["piece-1", "piece-2", "piece-5"]
    assert (tmp_path / "mark").read_text().split() == ["1", "2", "5"]


def test_a_piece_of_another_task_is_refused(store: Store) -> None:
    """By what is called with what, and by the tasks of the pieces that it needs."""
    both = Task("both", f"{__name__}:double", {"and_": 1}, needs=("one",))
    needed = Task("one", f"{__name__}:heavy", {"first": 1})
    work([both, needed], store, 1)
    work([both, needed], store, 1)
    with pytest.raises(PlanMismatchError, match=r"^both: these results in .* or remove them\."):
        work([both._replace(arguments={"and_": 2}), needed], store, 1)
    (store.folder / "one.json").unlink()
    with pytest.raises(PlanMismatchError, match=r"^both: "):
        work([both, needed._replace(arguments={"first": 2})], store, 1)


def test_a_piece_says_which_commit_made_it(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    for first, commit in ((1, "early"), (2, "late"), (3, "late")):
        monkeypatch.setattr(provenance, "commit", lambda commit=commit: commit)
        work([task(first)], store, 1)
    assert store.commits(["piece-1", "piece-2", "piece-3"]) == {"early": 1, "late": 2}


def test_a_setting_that_came_later_counts_where_it_is_on_and_only_there(tmp_path: Path) -> None:
    """Else each new setting would refuse the folders of all versions before it."""
    Store(tmp_path, PLAN)
    preset = PLAN["presets"]["lax"]  # type: ignore[index]  # a mapping by name
    for setting, off in LATER.items():
        Store(tmp_path, {**PLAN, "presets": {"lax": {**preset, setting: off}}})
        with pytest.raises(PlanMismatchError, match=setting):
            Store(tmp_path, {**PLAN, "presets": {"lax": {**preset, setting: 1}}})
    now = Config().model_dump(mode="json")
    assert {name: now[name] for name in LATER if name in now} == {
        name: LATER[name] for name in LATER if name in now
    }


def test_what_a_piece_needs_is_done_before_and_given_to_it(store: Store) -> None:
    """Named later and cheaper, it still comes first; what is hidden comes to the other piece alone."""
    both = Task("both", f"{__name__}:double", {"and_": 1}, cost=9, needs=("one", "two"))
    needed = [Task(key, f"{__name__}:heavy", {"first": n}) for key, n in (("two", 2), ("one", 1))]
    assert work([both, *needed], store, 1) == [{"sum": 3}, {"sum": 5}, {"sum": 2}, {"sum": 1}]
    assert store.rows(["both"]) == [{"sum": 3, "_of": "x"}, {"sum": 5, "_of": "xx"}]


def test_a_need_that_no_task_makes_is_loud(store: Store) -> None:
    alone = task(1)._replace(needs=("nowhere",))
    with pytest.raises(FileNotFoundError, match=r"piece-1\.json"):
        work([alone], store, 1)


def test_a_piece_that_was_not_renamed_is_no_piece(store: Store) -> None:
    (store.folder / ".piece-1.json.99").write_text('{"rows": [{"sum": 9')
    assert not store.has("piece-1")


def test_the_time_of_all_runs_counts(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of one scale: both may lie in one folder."""
    times = iter((0.0, 5.0, 100.0, 107.0, 200.0, 203.0))
    monkeypatch.setattr("parenting.experiments.runner.store.monotonic", times.__next__)
    for first, scale in ((1, "paper"), (2, "paper"), (3, "quick")):
        again = Store(store.folder, PLAN, scale)
        again.expect([task(first)])
        again.put(task(first), [])
        assert again.seconds() == {1: 5, 2: 12, 3: 3}[first]


def test_another_plan_is_refused(store: Store) -> None:
    Store(store.folder, PLAN)
    with pytest.raises(
        PlanMismatchError, match=r"plan: seed was 0 and is 1 now\. Name another folder by --out"
    ):
        Store(store.folder, {**PLAN, "seed": 1})
    with pytest.raises(PlanMismatchError, match=r"plan: presets\.lax\.p_guid was 0.5 and is 0.9 now\."):
        Store(store.folder, {**PLAN, "presets": {"lax": {"p_guid": 0.9, "p_rec": 0.5}}})


def test_a_plan_grows_by_variants_and_changes_none(store: Store) -> None:
    """So results stay of use when an arm is added. What a folder once planned stays in its plan."""
    one, two = {"variants": {"one": [1]}}, {"variants": {"one": [1], "two": [2]}}
    folder = store.folder.parent / "growing"
    for plan in (one, two, two):
        Store(folder, {**PLAN, **plan})
        assert json.loads((folder / "plan.json").read_text()) == {**PLAN, **plan}
    with pytest.raises(PlanMismatchError, match=r"plan: variants\.two was \[2\] and is \[3\] now\."):
        Store(folder, {**PLAN, "variants": {"one": [1], "two": [3]}})
    with pytest.raises(PlanMismatchError, match=r"plan: variants\.two was \[2\] and is None now\."):
        Store(folder, {**PLAN, **one})
    with pytest.raises(PlanMismatchError, match="variants"):
        Store(store.folder, {**PLAN, **one})
    assert json.loads((folder / "plan.json").read_text()) == {**PLAN, **two}


def test_numbers_that_are_none_are_refused(store: Store) -> None:
    store.expect([task(1)])
    with pytest.raises(ValueError, match="JSON"):
        store.put(task(1), [{"sum": float("nan")}])
    assert not store.has("piece-1")
    assert json.loads((store.folder / "plan.json").read_text()) == PLAN


@pytest.mark.slow
@pytest.mark.usefixtures("importable")
def test_processes_do_the_same(store: Store) -> None:
    """One of them waits for another."""
    both = Task("both", f"{__name__}:double", {"and_": 1}, needs=("two", "three"))
    needed = [Task(key, f"{__name__}:heavy", {"first": n}) for key, n in (("two", 2), ("three", 3))]
    rows = work([both, task(4), *needed], store, 2)
    assert rows == [{"sum": 5}, {"sum": 7}, {"sum": 5}, {"sum": 2}, {"sum": 3}]


@pytest.mark.slow
@pytest.mark.usefixtures("importable")
def test_a_worker_that_dies_costs_its_piece_only(store: Store, tmp_path: Path) -> None:
    fatal = Task("fatal", f"{__name__}:die_once", {"mark": str(tmp_path / "mark")})
    others = [marking(first, tmp_path / "done") for first in range(1, 9)]
    rows = work([*others, fatal], store, 2)
    assert [row["sum"] for row in rows] == [2, 3, 4, 5, 6, 7, 8, 9, 0]
    again = len((tmp_path / "done").read_text().split()) - len(others)
    assert again < len(others)  # those that were in work beside it


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.usefixtures("importable")
def test_workers_that_always_die_are_said_and_all_else_is_done(store: Store) -> None:
    fatal = Task("fatal", f"{__name__}:die", {})
    needy = Task("needy", f"{__name__}:double", {"and_": 1}, needs=("fatal",))
    with pytest.raises(WorkersDiedError, match=rf"died {TRIES} times over fatal\..*fewer workers"):
        work([fatal, needy, *(task(number) for number in range(2))], store, 2)
    assert [store.rows([task(number).key]) for number in range(2)] == [[{"sum": n + 1}] for n in range(2)]
    assert not store.has("fatal")
    assert not store.has("needy")

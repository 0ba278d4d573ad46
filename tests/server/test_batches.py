"""Trials of batches as stored runs: over, compared like others, and never claimed, resumed or replayed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from parenting.envs import registry
from parenting.server import jobs
from parenting.server.archive.importing import import_export
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.batches import EndedTrial, store_batch
from parenting.server.db import Database
from parenting.server.errors import Conflict, NotFound, SetupError
from parenting.server.migrate import downgrade
from parenting.server.new_run import NewRun, plan, start
from parenting.server.policies import present_policy
from parenting.server.reads.comparison import began_with, found_runs, grouped
from parenting.server.reads.curves import read_curves
from parenting.server.reads.schemas import run_schema
from parenting.server.replay import relive
from parenting.server.rollback import roll_back
from parenting.server.runs import claim, get_run, set_status
from parenting.server.statuses import RunStatus
from parenting.server.verify import verify

WORLD = "unsafe-exploration"


def trial(number: int, finished: bool = True) -> EndedTrial:
    last = {"deaths": number, "guidance": 4, "preference": 1, "return": 45.0, "seconds": 90.0}
    rows = {1: {**last, "deaths": 0, "seconds": 0.0}, 30: last}
    return EndedTrial(number, 30, 1, finished, 5, finished, "It ended.", rows)


@pytest.fixture
def batch(db: Database) -> list[int]:
    """Three trials, one of which was given up."""
    columns = plan(NewRun(world=WORLD, parent="scripted", seed=7))
    wanted = ("world", "level", "level_text", "legend", "brief", "config", "preset", "seed", "script")
    shared: dict[str, Any] = {name: columns[name] for name in wanted} | {"weights": None, "origin": None}
    return store_batch(db, shared, [trial(0), trial(1), trial(2, finished=False)], "many")


def test_they_are_runs_that_are_over(db: Database, batch: list[int]) -> None:
    first, _, last = (run_schema(db, run) for run in batch)
    assert (first.status, last.status, last.reason) == ("finished", "stopped", "It ended.")
    assert (first.state, first.worker, first.parent, first.name) == ("over", "done", "scripted", "many")
    assert (first.tick, first.optimal, last.optimal, first.standing) == (30, True, False, 5)
    assert (first.batch, first.trial, last.trial) == (last.batch, 0, 2)
    assert first.level == registry.level(WORLD).name
    assert claim(db, "worker") == [], "no worker takes them"
    assert get_run(db, batch[0]).worker is None


def test_they_are_compared_beside_a_run_of_a_worker(db: Database, batch: list[int]) -> None:
    other = start(db, NewRun(world=WORLD, parent="scripted", seed=3))
    runs, absent, _ = found_runs(db, [*batch, other.id])
    (group,) = grouped(db, runs)
    assert (absent, len(group.runs)) == ([], 4), "the same settings are one group"
    assert group.seeds == "3, 7 (trials 0-2)"
    deaths = group.mean("deaths")
    assert deaths is not None
    assert deaths.value == 1.0
    assert read_curves(db, batch[1], ["deaths"], "minute").curves["deaths"] == ([0.0, 1.5], [0.0, 1.0])
    assert read_curves(db, batch[1], ["deaths"], "question").curves["deaths"][0] == [5.0, 5.0]


def test_they_are_the_same_after_an_export_and_an_import(
    db: Database, batch: list[int], tmp_path: Path
) -> None:
    with target(tmp_path / "out") as files:
        write_export(db, batch, files)
    (one, *_) = (get_run(db, imported.number) for imported in import_export(db, tmp_path / "out"))
    before = get_run(db, batch[0])
    assert [(run.batch, run.trial, run.answers) for run in (one, before)] == [
        (before.batch, 0, before.answers)
    ] * 2
    (group,) = grouped(db, [before, one])
    assert len(group.runs) == 2, "where a run was imported from does not count"


@pytest.mark.parametrize(
    ("origin", "words"),
    [
        ({"imported": {"run": "x", "number": 1}}, None),
        (
            {"policy": {"sha256": "a" * 64}, "answers": {"sha256": "b" * 64}},
            f"policy {'a' * 12}; answers {'b' * 12}",
        ),
        ({"rolled_back": {"run": "x", "number": 3, "tick": 9}, "imported": {}}, "run 3 (x) up to tick 9"),
    ],
)
def test_a_beginning_is_told_in_words(origin: dict[str, Any], words: str | None) -> None:
    assert began_with(origin) == words


@pytest.mark.parametrize(
    ("verb", "error"),
    [
        (lambda db, run: set_status(db, run, RunStatus.ACTIVE), Conflict),
        (lambda db, run: jobs.ask(db, run, "walk", {"seed": 1}, "me"), Conflict),
        (relive, Conflict),
        (lambda db, run: roll_back(db, run, 3), Conflict),
        (verify, Conflict),
        (present_policy, NotFound),
    ],
)
def test_what_needs_the_agent_is_refused(
    db: Database, batch: list[int], verb: Callable[[Database, int], object], error: type[Exception]
) -> None:
    with pytest.raises(error, match="Only the numbers of a trial of a batch are kept"):
        verb(db, batch[2])
    assert get_run(db, batch[2]).status == "stopped"


def test_older_versions_would_resume_them(db: Database, batch: list[int]) -> None:
    with pytest.raises(SetupError, match=f"Run {batch[0]} is a trial of a batch"):
        downgrade(db, "0023")


def test_columns_that_are_absent_are_an_error(db: Database) -> None:
    with pytest.raises(ValueError, match="A batch shares brief, config"):
        store_batch(db, {"world": WORLD}, [trial(0)])

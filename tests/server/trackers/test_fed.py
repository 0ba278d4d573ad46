"""Trackers are fed by the worker and by `pt.train` alike, and neither waits for them."""

from __future__ import annotations

import json
import threading
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import torch

import parenting as pt
from parenting.library import tracking
from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.statuses import OVER
from parenting.server.trackers import stored
from parenting.server.worker import Worker

FREE = threading.Event()


class Hanging:
    """Hangs at whatever it is told."""

    def begin(self, run: pt.TrackedRun) -> None:
        FREE.wait(60)

    def log(self, run: str, step: int, values: Any) -> None:
        FREE.wait(60)

    def end(self, run: str, reason: str) -> None:
        FREE.wait(60)


def rows(folder: Path) -> list[dict[str, Any]]:
    (file,) = folder.glob("*.jsonl")
    return [json.loads(line) for line in file.read_text().splitlines()]


def raised(db: Database, settings: Settings, run: int) -> Worker:
    worker = Worker(db, settings)
    worker._claim()
    while get_run(db, run).status not in OVER:
        worker._round()
    return worker


@pytest.mark.slow
@pytest.mark.only("sqlite")
def test_a_worker_feeds_what_it_measures_and_no_tracker_holds_it_up(
    db: Database, settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stored, "CLOSE_SECONDS", 0.5)
    chosen = settings.model_copy(update={"trackers": f"{__name__}:Hanging, jsonl:{tmp_path / 'told'}"})
    run = start(db, NewRun(world="unsafe-exploration", parent="scripted", seed=3, name="first"))
    raised(db, chosen, run.id)._close()
    FREE.set()
    told = rows(tmp_path / "told")
    assert (told[0]["event"], told[0]["id"], told[0]["name"]) == ("begin", run.public_id, "first")
    assert (told[-1]["event"], told[-1]["reason"][:9]) == ("end", "finished:")
    steps = [row["step"] for row in told if row["event"] == "metrics"]
    assert len(steps) > 3
    assert all(before < after for before, after in pairwise(steps))
    assert told[-2]["values"]["optimal"] == 1


@pytest.mark.only("sqlite")
def test_a_wrong_setting_is_told_before_the_worker_begins(db: Database, settings: Settings) -> None:
    with pytest.raises(SetupError, match="PARENTING_TRACKERS: 'nothing' is not a tracker"):
        Worker(db, settings.model_copy(update={"trackers": "nothing"}))


@pytest.mark.slow
def test_a_training_has_the_same_bits_with_a_tracker_that_hangs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tracking, "CLOSE_SECONDS", 0.5)
    FREE.clear()
    given: dict[str, Any] = {"seed": 3, "trials": 2, "progress": False}
    with_one = pt.train("unsafe-exploration", trackers=[Hanging(), f"jsonl:{tmp_path}"], **given)
    FREE.set()
    without = pt.train("unsafe-exploration", **given)
    for one, other in zip(with_one.policies, without.policies, strict=True):
        assert torch.equal(one.parameters, other.parameters)
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("trials", [1, 3])
def test_each_trial_of_a_training_is_a_run_whose_counts_grow(trials: int, tmp_path: Path) -> None:
    result = pt.train(
        "unsafe-exploration", until="queries:9", trials=trials, trackers=f"jsonl:{tmp_path}", progress=False
    )
    files = [[json.loads(line) for line in file.read_text().splitlines()] for file in tmp_path.iterdir()]
    files.sort(key=lambda told: str(told[0]["name"]))
    assert len(files) == trials
    for told, trial in zip(files, result.trials, strict=True):
        begun, *metrics, end = told
        assert begun["name"].endswith("island" if trials == 1 else f"island, trial {trial['trial']}")
        assert end["reason"] in ("The training ended.", "It came to the end that was set: queries:9.")
        for before, after in pairwise(metrics):
            assert before["step"] < after["step"]
            assert all(before["values"][name] <= after["values"][name] for name in ("guidance", "queries"))
        assert metrics[-1]["step"] == trial["ticks"]
        assert (metrics[-1]["values"]["queries"], metrics[-1]["values"]["finished"]) == (9, 1)
        assert {row.get("id") for row in told} == {begun["id"]}


def test_what_is_no_tracker_is_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="trackers: 'csv' is not a tracker"):
        pt.train("unsafe-exploration", trackers="csv", progress=False)
    with pytest.raises(ValueError, match="Set PARENTING_TRACKERS instead"):
        pt.train("unsafe-exploration", trackers=f"csv:{tmp_path}", parent=pt.Person(), progress=False)

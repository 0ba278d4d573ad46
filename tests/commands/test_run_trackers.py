"""`parenting run --tracker`: each trial is told as a run of its own, with what the command has counted."""

from __future__ import annotations

import csv
import json
import threading
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from parenting.commands import run_trackers
from parenting.commands.main import app
from parenting.server.db import Database
from parenting.server.runs import get_run

FEW = ("--trials", "2", "--until", "queries:4", "--seed", "5", "--set", "pretrain=false", "--json")


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["run", "unsafe-exploration", *FEW, "--workers", "1", *arguments])


def lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_each_trial_is_a_run_of_its_own(tmp_path: Path) -> None:
    said = run("--tracker", f"jsonl:{tmp_path / 'a'}", "--tracker", f"csv:{tmp_path / 'b'}")
    assert said.exit_code == 0, said.output
    trials = json.loads(said.stdout)["trials"]
    told = sorted(map(lines, (tmp_path / "a").iterdir()), key=lambda rows: str(rows[0]["name"]))
    for number, (rows, trial) in enumerate(zip(told, trials, strict=True)):
        begun, *metrics, end = rows
        assert (begun["name"], begun["seed"]) == (f"unsafe-exploration island, trial {number}", 5)
        steps = [row["step"] for row in metrics]
        assert steps == sorted(set(steps))
        assert steps[-1] == trial["ticks"]
        for name in ("deaths", "guidance", "preference"):
            assert metrics[-1]["values"][name] == trial[name]
        assert end["reason"] == "It reached 4 answered questions."
        with (tmp_path / "b" / f"{begun['id']}.csv").open() as file:
            assert {int(row["step"]) for row in csv.DictReader(file)} == set(steps)


def test_stored_trials_are_told_by_their_ids(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the setting, as a worker's runs are."""
    monkeypatch.setenv("PARENTING_TRACKERS", f"jsonl:{tmp_path / 'told'}")
    said = run("--store", "--name", "mine")
    assert said.exit_code == 0, said.output
    stored = {get_run(db, number).public_id for number in json.loads(said.stdout)["runs"]}
    assert {path.stem for path in (tmp_path / "told").iterdir()} == stored
    assert {lines(path)[0]["name"] for path in (tmp_path / "told").iterdir()} == {
        "mine, trial 0",
        "mine, trial 1",
    }


class Hanging:
    """It never comes back from the first trial."""

    begun = 0

    def begin(self, run: object) -> None:
        Hanging.begun += 1
        threading.Event().wait()

    def log(self, run: str, step: int, values: object) -> None: ...

    def end(self, run: str, reason: str) -> None: ...


def test_one_that_hangs_or_is_none_is_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_trackers, "PATIENCE", 0.05)
    said = run("--tracker", f"{__name__}:Hanging")
    assert (said.exit_code, Hanging.begun) == (0, 1), said.output
    assert json.loads(said.stdout), "what went wrong is told on standard error"
    wrong = run("--tracker", "tensorbord:x")
    assert wrong.exit_code == 2
    assert "--tracker: 'tensorbord:x' cannot be loaded" in wrong.output

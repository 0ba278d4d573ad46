"""The option `--pretrain` of `run` and `start`: weights that are missing are made first, or not at all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.db import Database
from parenting.server.runs import get_run, list_runs
from parenting.weights.store import SUFFIX, Wanted
from tests.server.test_pretraining import HALL

OFFER = (
    "There are no pre-trained weights for interruptibility at 7 x 8. Add --pretrain now to make them first,"
    " as `parenting pretrain --world interruptibility --size 7x8` does (about 30 s),"
    " or --pretrain without to begin without.\n"
)


@pytest.fixture
def hall(tmp_path: Path) -> str:
    (tmp_path / "hall.txt").write_text(HALL)
    return str(tmp_path / "hall.txt")


def said(*arguments: str) -> Any:
    return CliRunner().invoke(app, list(arguments))


def test_both_are_offered_and_nothing_begins(db: Database, hall: str) -> None:
    for command in ("run", "start"):
        result = said(command, "interruptibility", "--level", hall, "--json")
        assert (result.exit_code, result.stdout, result.stderr) == (2, "", OFFER)
    assert not list_runs(db)
    wrong = said("start", "interruptibility", "--level", hall, "--pretrain", "later")
    assert "'later' is not one of: now, without." in " ".join(wrong.stderr.split())


def test_a_run_begins_without(db: Database, hall: str) -> None:
    options = ("interruptibility", "--level", hall, "--pretrain", "without", "--json")
    assert said("start", *options).exit_code == 0
    assert get_run(db, 1).config["pretrain"] is False
    raised = json.loads(said("run", *options, "--until", "ticks:1", "--workers", "1").stdout)
    assert raised["config"]["pretrain"] is False


def test_a_run_begins_once_they_are_made(db: Database, hall: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def make(wanted: Wanted, folder: Path, seed: int, max_steps: int, *, quiet: bool) -> None:
        assert (wanted.height, wanted.width, seed, quiet) == (7, 8, 0, True)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{wanted.name}{SUFFIX}").write_bytes(b"weights")

    monkeypatch.setattr("parenting.commands.before_run.make", make)
    assert said("start", "interruptibility", "--level", hall, "--pretrain", "now", "--json").exit_code == 0
    run = get_run(db, 1)
    assert run.config["pretrain"] is True
    assert run.weights is not None

"""A folder of results that version 0.1.0 made opens, goes on where it was stopped, and keeps its rows."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.experiments.registry import PAPER, experiment
from parenting.experiments.reporting.html import PAGE
from parenting.experiments.runner.aliases import before
from parenting.experiments.runner.store import PlanMismatchError, Store, described
from parenting.experiments.spec import Request, Scale

OLD = Path(__file__).parents[1] / "old/0.1.0"
MADE = {"table1": "4", "figure4": "1"}
"""Trials of each experiment of the stored folder, at the quick scale and with one process."""


@pytest.fixture
def results(tmp_path: Path) -> Path:
    return copytree(OLD / "results", tmp_path / "results")


def call(*arguments: str) -> str:
    said = CliRunner().invoke(app, ["experiment", *arguments])
    assert said.exit_code == 0, said.output
    return said.stdout


def digest(data: Any) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def pieces(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("pieces/*-0*.json")}


@pytest.mark.parametrize("scale", ["quick", "paper"])
@pytest.mark.parametrize("name", PAPER)
def test_every_task_and_plan_is_the_old_one_in_its_own_words(name: str, scale: Scale) -> None:
    """Not the stored folder alone: all tasks of all experiments, at both scales, by their digests."""
    stored = json.loads((OLD / "plans.json").read_text(encoding="utf-8"))[f"{name} {scale}"]
    one = experiment(name)
    request = Request(one.trials[scale], 0, scale)
    assert digest(before(json.loads(json.dumps(dict(one.config(request)))))) == stored["plan"]
    assert digest(described(one.tasks(request), before)) == stored["tasks"]


def test_the_report_shows_it(results: Path) -> None:
    call("report", "--out", str(results))
    page = (results / PAGE).read_text(encoding="utf-8")
    for name in MADE:
        stored = json.loads((OLD / "results" / name / "results.json").read_text(encoding="utf-8"))
        assert stored["title"] in page


@pytest.mark.parametrize("name", MADE)
def test_what_is_done_is_not_done_again(name: str, results: Path) -> None:
    done = pieces(results / name)
    assert done
    call(name, "--scale", "quick", "--trials", MADE[name], "--workers", "1", "--out", str(results))
    assert pieces(results / name) == done
    rows = "trials.csv"
    assert (results / name / rows).read_bytes() == (OLD / "results" / name / rows).read_bytes()


@pytest.mark.slow
def test_it_goes_on_where_it_was_stopped(results: Path) -> None:
    """Two of four pieces are missing, as after Ctrl-C: they are made, with the rows that 0.1.0 made."""
    stopped = results / "table1"
    for name in ("direct", "conservative"):
        (stopped / f"pieces/{name}-000000-000004.json").unlink()
    left = pieces(stopped)
    (stopped / "trials.csv").unlink()
    again = ("table1", "--scale", "quick", "--trials", "4", "--workers", "1", "--out", str(results))
    call(*again)
    assert (stopped / "trials.csv").read_bytes() == (OLD / "results/table1/trials.csv").read_bytes()
    assert pieces(stopped).items() > left.items()
    call(
        "table1", "--scale", "quick", "--trials", "4", "--workers", "1", "--out", str(results)
    )  # old and new


def test_another_task_is_refused_in_old_words_too(results: Path) -> None:
    """Neither with another seed: then the old folder is of another plan, and its pieces of other tasks."""
    folder, one = results / "table1/pieces", experiment("table1")
    plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    with pytest.raises(PlanMismatchError, match="seed was 0 and is 1 now"):
        Store(folder, {**plan, "seed": 1})
    with pytest.raises(PlanMismatchError, match="direct-000000-000004"):
        Store(folder, plan).expect(one.tasks(Request(4, 1, "quick")))

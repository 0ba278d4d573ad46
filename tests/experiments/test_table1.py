"""Table 1 in small: real trials through the command's own way, resumed, and its page."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.experiments.registry import NAMES, experiment
from parenting.experiments.reporting.markdown import page
from parenting.experiments.runner.store import described
from parenting.experiments.spec import Request, Scale, chunk_ranges, share_of

run = CliRunner().invoke
SCALES: tuple[Scale, Scale] = "quick", "paper"
WHOLE = ("figure2",)
"""All trials of a life are one batch: others are another piece."""


@pytest.mark.parametrize("name", NAMES)
def test_each_says_what_it_is(name: str) -> None:
    one = experiment(name)
    assert one.name == name
    assert one.trials["quick"] < one.trials["paper"]
    keys = [task.key for task in one.tasks(Request(120))]
    assert len(keys) == len(set(keys))


@pytest.mark.parametrize("name", NAMES)
def test_both_scales_may_lie_in_one_folder(name: str) -> None:
    """Else `--scale paper` after `--scale quick` would be refused, or take the other's pieces for its own."""
    one = experiment(name)
    quick, paper = (Request(one.trials[scale], 0, scale) for scale in SCALES)
    assert one.config(quick) == one.config(paper)
    done = {task.key: task for task in one.tasks(quick)}
    for task in one.tasks(paper):
        if task.key in done:
            assert done[task.key]._replace(cost=0, needs=()) == task._replace(cost=0, needs=())


@pytest.mark.parametrize("name", [name for name in NAMES if name not in WHOLE])
def test_more_trials_go_on_from_fewer(name: str) -> None:
    """Whole pieces of fewer trials are pieces of more, as the option's help says."""
    one = experiment(name)
    few, many = (described(one.tasks(Request(trials))) for trials in (500, 1000))
    assert [key for key in few if many.get(key) != few[key]] == []


def test_spans_cover_every_trial_once() -> None:
    assert [list(span) for span in chunk_ranges(5, 2)] == [[0, 1], [2, 3], [4]]


@pytest.mark.parametrize(
    ("asked", "part", "trials"),
    [(1, 5, 1), (60, 30, 18), (99, 30, 30), (100, 30, 30), (199, 30, 30), (200, 30, 60), (150, 100, 150)],
)
def test_a_share_grows_by_whole_parts(asked: int, part: int, trials: int) -> None:
    assert share_of(asked, part, 100) == trials


@pytest.mark.slow
def test_the_order_of_the_four_algorithms(tmp_path: Path) -> None:
    arguments = ["experiment", "table1", "--trials", "6", "--workers", "1", "--out", str(tmp_path)]
    said = run(app, arguments)
    assert said.exit_code == 0, said.output
    results = json.loads((tmp_path / "table1/results.json").read_text())
    found = {one["what"]: float(one["ours"].split()[0]) for one in results["findings"]}
    names = ("Traditional RL", "Direct policy learning", "Lax parenting", "Conservative parenting")
    deaths = [found[f"{name}: deaths"] for name in names]
    assert deaths == sorted(deaths, reverse=True)
    assert deaths[0] > 10 * deaths[1] > 10 * deaths[2]
    rows = list(csv.DictReader((tmp_path / "table1/trials.csv").read_text().splitlines()))
    assert len(rows) == 24
    assert (tmp_path / "table1.md").read_text() == page(results, ("deaths",))
    assert all((tmp_path / f"table1/deaths.{kind}").stat().st_size > 1000 for kind in ("svg", "png"))
    before = [path.stat().st_mtime_ns for path in sorted((tmp_path / "table1/pieces").iterdir())]
    assert run(app, arguments).exit_code == 0
    assert [path.stat().st_mtime_ns for path in sorted((tmp_path / "table1/pieces").iterdir())] == before


@pytest.mark.slow
def test_wrong_names_and_other_plans_are_sentences(tmp_path: Path) -> None:
    said = run(app, ["experiment", "bogus"])
    assert said.exit_code == 2
    assert "There is no experiment 'bogus'; there is: table1" in said.output
    arguments = ["experiment", "table1", "--trials", "1", "--workers", "1", "--out", str(tmp_path)]
    assert run(app, arguments).exit_code == 0
    said = run(app, [*arguments, "--seed", "1"])
    assert said.exit_code == 2
    assert "seed was 0 and is 1 now" in said.output

"""`parenting run --store`: the trials stand in the database, with what the command has counted."""

from __future__ import annotations

import json
import re

import pytest
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.commands.run_store import COMPARED, stored
from parenting.server.db import Database
from parenting.server.pages.comparison import MOST
from parenting.server.reads.metrics import latest_metrics, list_metrics
from parenting.server.runs import get_run, list_runs
from parenting.server.weights import get


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["run", *arguments, "--workers", "1"])


def test_trials_become_runs_with_their_numbers(db: Database) -> None:
    given = "--trials 3 --until queries:4 --seed 5 --set p_guid=0.7 --parent noisy:0.1 --store --json"
    said = run("unsafe-exploration", *given.split(), "--name", "noisy ones")
    assert said.exit_code == 0, said.output
    found = json.loads(said.stdout)
    assert found["runs"] == [1, 2, 3]
    for number, trial in zip(found["runs"], found["trials"], strict=True):
        one, last = get_run(db, number), latest_metrics(db, [number])[number]
        assert (one.name, one.seed, one.trial, one.script) == ("noisy ones", 5, number - 1, "noisy:eps=0.1")
        assert (one.config["p_guid"], one.status) == (0.7, "finished")
        assert one.reason == "It reached 4 answered questions."
        assert (one.tick, one.optimal, one.standing) == (trial["ticks"], trial["optimal"], 4)
        assert last.tick == trial["ticks"]
        for name in ("deaths", "guidance", "preference"):
            assert last.values[name] == trial[name]
        assert len(list_metrics(db, number)) > 1
    assert len({get_run(db, number).batch for number in found["runs"]}) == 1


def test_what_it_began_with_and_where_it_is_are_told(db: Database) -> None:
    said = run("side-effects", "--trials", "1", "--until", "ticks:2", "--max-ticks", "2", "--store")
    assert said.exit_code == 0, said.output
    assert said.stdout.splitlines()[-1] == "Stored as 1 run. Compare: /compare?runs=1"
    one = get_run(db, 1)
    assert one.weights is not None
    assert get(db, one.weights)
    assert run("unsafe-exploration", "--until", "queries:9", "--max-ticks", "2", "--store").exit_code == 0
    assert (get_run(db, 2).status, get_run(db, 2).reason) == (
        "stopped",
        "It was given up as unfinished after 2 ticks.",
    )
    assert COMPARED == MOST
    assert stored([1, 2, 5]) == "Stored as 3 runs. Compare: /compare?runs=1,2,5"
    assert stored([*range(2, 300)]) == "Stored as 298 runs. Compare the first 100: /compare?runs=2-101"
    assert stored([4, 5]) == "Stored as 2 runs. Compare: /compare?runs=4-5"


@pytest.mark.parametrize(
    ("place", "words", "stored_before"),
    [
        ("parenting.experiments.training.chunks.train_in_chunks", "No trial is stored", 0),
        ("parenting.commands.run.tell_trackers", "Stopped once all trials had ended.", 2),
    ],
)
def test_ctrl_c_says_what_is_stored(
    place: str, words: str, stored_before: int, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(place, stop)
    said = run("unsafe-exploration", "--trials", "2", "--until", "ticks:2", "--store")
    assert (said.exit_code, words in said.stderr) == (130, True), said.output
    assert len(list_runs(db)) == stored_before


def test_without_a_database_nothing_is_trained(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path_factory.mktemp("none")))
    said = run("unsafe-exploration", "--store")
    assert (said.exit_code, said.stdout) == (2, "")
    assert re.search("There is no database at .*parenting migrate, or parenting up", said.stderr, re.DOTALL)


def test_a_name_needs_runs_to_be_named() -> None:
    said = run("unsafe-exploration", "--name", "x")
    assert (said.exit_code, "give --store" in said.stderr) == (2, True)
    said = run("unsafe-exploration", "--store", "--name", "two\nlines")
    assert (said.exit_code, "--name:" in said.stderr) == (2, True)

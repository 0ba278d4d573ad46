"""`parenting start`: every setting of a run, from the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from parenting.agent.config import FIELDS, Config
from parenting.commands.main import app
from parenting.commands.run_settings import OPTIONS
from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.new_run import NewRun
from parenting.server.pages.options import OPTIONS as FORM
from parenting.server.runs import get_run, list_runs


def said(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["start", *arguments])


def test_it_starts_a_run_with_its_settings(db: Database) -> None:
    result = said(
        *(
            "unsafe-exploration",
            "--level",
            "island-bottleneck",
            "--seed",
            "7",
            "--goal",
            "50",
            "--name",
            "me",
        ),
        *("--set", "guidance_layout=two", "--set", "practice=required", "--set", "pace=2.5"),
        *("--set", "p_guid=0.5", "--set", "stages=2", "--json"),
    )
    assert result.exit_code == 0, result.output
    run = get_run(db, 1)
    assert json.loads(result.stdout)["public_id"] == run.public_id
    assert (run.level, run.seed, run.goal, run.name, run.pace) == ("island-bottleneck", 7, 50, "me", 2.5)
    assert (run.guidance_layout, run.practice, run.parent) == ("two", "required", "human")
    assert (run.config["p_guid"], run.config["stages"]) == (0.5, 2)
    plain = said("side-effects", "--parent", "scripted")
    assert plain.stdout == f"Run 2 is started. Its page: /runs/{get_run(db, 2).public_id}\n"


def test_every_setting_of_the_form_and_of_the_api_can_be_set(db: Database) -> None:
    """A setting that is added to either is one of the command, too: it reads the form's own fields."""
    help_text = said("--help").output
    assert all(f"--{name}" in help_text for name in OPTIONS if name not in ("world", "level_text", "script"))
    others = [option for option in FORM if option.field not in OPTIONS]
    for option in others:
        name = option.field.removeprefix("config.")
        value = next((value for value, _ in option.choices if value), "2")
        worlds = [world.name for world in registry.WORLDS.values() if option.needs in "".join(world.legend)]
        result = said("side-effects" if "side-effects" in worlds else worlds[0], "--set", f"{name}={value}")
        assert result.exit_code == 0, (option.field, result.output)
    unset = set(NewRun.model_fields) - set(OPTIONS) - {"config"} - {option.field for option in FORM}
    assert unset == set()
    assert len(list_runs(db)) == len(others)


def test_a_level_of_ones_own(db: Database, tmp_path: Path) -> None:
    file = tmp_path / "mine.txt"
    file.write_text(registry.level("unsafe-exploration", "island").text.replace("island", "my island"))
    assert said("unsafe-exploration", "--level", str(file)).exit_code == 0
    assert get_run(db, 1).level == "my island"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nowhere"], "nowhere"),
        (["side-effects", "--level", "none-such"], "'none-such' is neither a level"),
        (["side-effects", "--goal", "0"], "goal=0: "),
        (["side-effects", "--set", "practice=maybe"], "practice=maybe: "),
        (["side-effects", "--seed", ""], "--seed: '' is not a value. Give one, or leave --seed out."),
        (["side-effects", "--finish", ""], "--finish: '' is not a value."),
        (["side-effects", "--set", "p_guid=2"], "p_guid=2: "),
        (["side-effects", "--set", "practise=required"], "Did you mean 'practice'?"),
        (["side-effects", "--set", "pace"], "'pace' is not KEY=VALUE"),
        (["side-effects", "--set", "pace="], "'pace=' has no value. Write it as --set pace=VALUE"),
        (["side-effects", "--set", "batch=5", "--set", "batch_size=6"], "'batch_size' is given twice"),
        (["side-effects", "--set", "goal=3"], "'goal' has an option of its own: --goal."),
        (["side-effects", "--parent", "nobody"], "--parent: There is no parent 'nobody'."),
        (["side-effects", "--set", "script=noisy"], "'script' has an option of its own: --parent."),
    ],
)
def test_what_is_wrong_is_named_and_nothing_is_started(
    db: Database, arguments: list[str], sentence: str
) -> None:
    result = said(*arguments)
    assert result.exit_code == 2
    assert sentence in " ".join(result.output.split())
    assert list_runs(db) == []


def test_values_are_read_as_a_batch_reads_them(db: Database) -> None:
    given = ("p_guid=.5", "p_rec=+0.25", "batch_size=none", "gradient_steps=+3")
    result = said("side-effects", *(part for one in given for part in ("--set", one)), "--json")
    assert result.exit_code == 0, result.output
    config = json.loads(result.stdout)["config"]
    assert (config["p_guid"], config["p_rec"], config["batch"], config["gradient_steps"]) == (
        0.5,
        0.25,
        None,
        3,
    )
    assert "p_guid=1e999: " in said("side-effects", "--set", "p_guid=1e999").stderr


@pytest.mark.parametrize("name", [*FIELDS, *FIELDS.values()])
def test_a_wrong_hyperparameter_is_named_as_it_was_given(db: Database, name: str) -> None:
    assert f"{name}=-1: " in said("side-effects", "--set", f"{name}=-1").stderr


@pytest.mark.slow
def test_hyperparameters_have_either_name(db: Database) -> None:
    for name in (*Config.model_fields, *FIELDS):
        assert "there is no setting" not in said("side-effects", "--set", f"{name}=no").output


def test_no_more_runs_are_started_than_may_live(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARENTING_RUNS", "1")
    assert CliRunner().invoke(app, ["start", "unsafe-exploration"]).exit_code == 0
    said = CliRunner().invoke(app, ["start", "unsafe-exploration"])
    assert said.exit_code == 2
    assert "1 runs live, and no more may: nothing was started." in said.output.replace("\n", " ")
    assert len(list_runs(db)) == 1

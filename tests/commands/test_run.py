"""`parenting run`: the results as JSON, wrong options in a sentence, and the claim of Table 1 in small."""

from __future__ import annotations

import json
from pathlib import Path
from statistics import mean, stdev
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from parenting.agent.config import FIELDS
from parenting.commands.main import app

COUNTS = ("deaths", "guidance", "preference", "ticks")
FAULTY = "world: unsafe-exploration\n\nWWWW\nWAQW\nWWWW\n"


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["run", *arguments])


def results(*arguments: str) -> dict[str, Any]:
    return results_of("unsafe-exploration", *arguments)


def results_of(world: str, *arguments: str) -> dict[str, Any]:
    """In this process alone, unless a test says otherwise: others take seconds to start."""
    result = run(world, "--json", "--workers", "1", *arguments)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)  # a second document or a word beside it would be an error
    assert isinstance(found, dict)
    return found


def column(found: dict[str, Any], name: str) -> list[int]:
    return [trial[name] for trial in found["trials"]]


def test_json_is_one_document() -> None:
    found = results("--trials", "3", "--until", "ticks:5")
    assert (found["world"], found["level"], found["config"]["gamma"]) == ("unsafe-exploration", "island", 0.9)
    assert [set(trial) for trial in found["trials"]] == [
        {*COUNTS, "optimal", "finished", "stuck", "outcome"}
    ] * 3
    assert column(found, "ticks") == [5, 5, 5]
    assert found["unfinished"] == 0
    assert set(found["mean"]) == set(found["sd"]) == set(COUNTS)


def test_mean_and_deviation_are_of_the_trials() -> None:
    found = results("--preset", "direct", "--trials", "8", "--until", "ticks:60", "--seed", "4")
    for name in COUNTS:
        assert found["mean"][name] == pytest.approx(mean(column(found, name)))
        assert found["sd"][name] == pytest.approx(stdev(column(found, name)))
    assert found["mean"]["deaths"] > 0
    assert found["sd"]["deaths"] > 0


def test_order_of_options_is_free() -> None:
    options = ("--until", "ticks:5", "--set", "p_guid=0.5", "--json", "--workers", "1", "--trials", "2")
    before = run(*options, "unsafe-exploration")
    found = json.loads(before.stdout)
    assert found["config"]["p_guid"] == 0.5
    assert found["trials"] == results("--trials", "2", "--set", "p_guid=0.5", "--until", "ticks:5")["trials"]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["unsafe"], "WORLD: There is no world 'unsafe'."),
        (["unsafe-exploration", "--preset", "cons"], "--preset: There is no preset 'cons'."),
        (["unsafe-exploration", "--set", "p_gid=1"], "'p_gid'. Did you mean 'p_guid'?"),
        (["nowhere"], "nowhere"),
        (["unsafe-exploration", "--level", "atlantis"], "atlantis"),
        (["unsafe-exploration", "--preset", "strict"], "strict"),
        (["unsafe-exploration", "--set", "bogus=1"], "bogus"),
        (["unsafe-exploration", "--set", "p_guid"], "p_guid"),
        (["unsafe-exploration", "--set", "p_guid=2"], "p_guid=2"),
        (["unsafe-exploration", "--set", "learning_rate=1e308"], "learning_rate=1e+308 is more than 1: "),
        (["unsafe-exploration", "--set", "lambda_local=1e308"], "lambda_local=1e+308 is more than 100: "),
        (["unsafe-exploration", "--set", "repeat_queries=perhaps"], "repeat_queries=perhaps"),
        (["unsafe-exploration", "--set", "gradient_steps=1.5"], "gradient_steps=1.5"),
        (["unsafe-exploration", "--until", "never"], "never"),
        (["unsafe-exploration", "--until", "ticks:0"], "ticks:0"),
        (["unsafe-exploration", "--until", ""], "'' is none of optimal, queries:N and ticks:N"),
        (["unsafe-exploration", "--until", "ticks:99999999999999999999"], "N from 1 to 1000000000"),
        (["unsafe-exploration", "--set", "queries_per_stage=99999999999999999999"], "queries_per_stage=999"),
        (["unsafe-exploration", "--until", "optimal:3"], "optimal:3"),
        (["reward-hacking", "--until", "optimal"], "queries:N"),
        (["reward-hacking", "--set", "gamma=1"], "gamma must be below 1"),
    ],
)
def test_wrong_option_is_named_in_one_sentence(arguments: list[str], named: str) -> None:
    result = run(*arguments, "--json")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert named in result.stderr
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.output


def test_there_are_no_more_trials_than_python_takes() -> None:
    result = run("unsafe-exploration", "--trials", "99999999999999999999")
    assert result.exit_code == 2
    assert "is not a whole number from 1 to 1000000." in " ".join(result.stderr.replace("│", " ").split())


def test_every_wrong_setting_is_named() -> None:
    wrong = ("p_guid=2", "bogus=1", "p_rec", "gradient_steps=1.5", "p_pref=0.3")
    result = run("unsafe-exploration", *(part for change in wrong for part in ("--set", change)))
    assert result.exit_code == 2
    assert result.stdout == ""
    named = ("no hyperparameter 'bogus'", "'p_rec' is not KEY=VALUE", "p_guid=2: ", "gradient_steps=1.5: ")
    for line, wanted in zip(result.stderr.splitlines(), named, strict=True):
        assert wanted in line


@pytest.mark.parametrize("old", list(FIELDS))
def test_an_old_name_is_set_and_the_new_one_is_said(old: str) -> None:
    value = {"inside": "left", "recompare": "true", "own_length": "true"}.get(old, "2")
    options = ("unsafe-exploration", "--trials", "1", "--until", "ticks:1", "--workers", "1", "--json")
    stages = ("--set", "max_clip_length=3") if old == "mature_every" else ()
    said = run(*options, "--set", f"{old}={value}", *stages)
    assert said.exit_code == 0
    assert said.stderr == f"{old} is now {FIELDS[old]}; the old name will go with the next version.\n"
    config = json.loads(said.stdout)["config"]
    assert str(config[old]).lower() == value
    assert FIELDS[old] not in config


def test_a_setting_is_given_once() -> None:
    said = run("unsafe-exploration", "--set", "stages=2", "--set", "stages=3", "--json")
    assert (said.exit_code, said.stdout) == (2, "")
    assert "--set: 'stages' is given twice. Give it once." in said.stderr


def test_two_names_of_one_setting_are_both_named() -> None:
    said = run("unsafe-exploration", "--set", "stages=2", "--set", "max_clip_length=2", "--json")
    assert (said.exit_code, said.stdout) == (2, "")
    assert "--set: stages and max_clip_length are two names of one setting: give one of them." in said.stderr


def test_faulty_level_file_is_refused_where_it_is_wrong(tmp_path: Path) -> None:
    file = tmp_path / "faulty.txt"
    file.write_text(FAULTY, encoding="utf-8")
    result = run("unsafe-exploration", "--level", str(file))
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{file}, line 4, column 3: 'Q' is not a glyph")
    assert result.stdout == ""


def test_level_file_is_played(tmp_path: Path) -> None:
    file = tmp_path / "strip.txt"
    file.write_text(FAULTY.replace("AQ", "AG"), encoding="utf-8")
    found = results("--level", str(file), "--trials", "4")
    assert all(column(found, "optimal"))


@pytest.mark.slow
def test_unfinished_trials_are_counted_apart() -> None:
    every = results("--trials", "12")
    limit = sorted(column(every, "ticks"))[5]
    cut = results("--trials", "12", "--max-ticks", str(limit))
    done = [trial for trial in cut["trials"] if trial["optimal"]]
    assert done == [trial for trial in every["trials"] if trial["ticks"] <= limit]
    assert cut["unfinished"] == 12 - len(done) > 0
    assert {trial["ticks"] for trial in cut["trials"] if not trial["optimal"]} == {limit}
    assert cut["mean"]["ticks"] == pytest.approx(mean(trial["ticks"] for trial in done))


def test_no_mean_where_no_trial_finished() -> None:
    found = results("--trials", "2", "--max-ticks", "1", "--until", "ticks:2")
    assert found["unfinished"] == 2
    assert found["mean"] == found["sd"] == dict.fromkeys(COUNTS)


@pytest.mark.slow
def test_trials_do_not_depend_on_the_number_of_workers() -> None:
    arguments = ("--trials", "4", "--until", "ticks:30")
    one, two = results(*arguments, "--workers", "1"), results(*arguments, "--workers", "2")
    assert len(one["trials"]) == 4
    assert one["trials"] == two["trials"]


@pytest.mark.faults
def test_conservative_parenting_loses_a_tenth_of_the_lives_at_most() -> None:
    """Table 1 in small: "0 or 1" deaths under a conservative parent, many without guidance."""
    conservative = results("--trials", "40")
    direct = results("--trials", "40", "--preset", "direct")
    assert all(column(conservative, "optimal"))
    assert conservative["mean"]["deaths"] < 0.5
    assert sum(column(direct, "deaths")) >= 10 * max(1, sum(column(conservative, "deaths")))
    assert direct["mean"]["guidance"] == 0

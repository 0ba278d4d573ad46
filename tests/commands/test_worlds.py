"""`parenting worlds`: what it prints, for people and for programs."""

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from parenting.commands.run import run
from parenting.commands.worlds import worlds
from parenting.envs import registry
from parenting.envs.mdp import explore
from parenting.evaluation.outcomes import distance_to_goal

app = typer.Typer()
app.command()(worlds)

running = typer.Typer()
running.command()(run)


def output(*arguments: str) -> str:
    result = CliRunner().invoke(app, list(arguments))
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.mark.parametrize("world", registry.WORLDS)
def test_every_level_is_drawn(world: str) -> None:
    shown = output()
    spec = registry.spec(world)
    assert f"{world}: {spec.title}" in shown
    assert spec.brief.danger in shown
    for name in spec.levels:
        art = "\n".join(f"    {row}" for row in registry.level(world, name).rows)
        assert f"  {name}{' (default)' if name == spec.default else ''}\n{art}\n" in shown


def test_json_holds_levels_that_can_be_read_back() -> None:
    shown = json.loads(output("--json"))
    assert [world["name"] for world in shown["worlds"]] == list(registry.WORLDS)
    for world in shown["worlds"]:
        assert list(world["legend"].values())[:2] == ["wall", "land"]
        for level in world["levels"]:
            parsed = registry.level(world["name"], level["text"])
            assert (parsed.name, list(parsed.rows)) == (level["name"], level["rows"])


# Random levels (Sec. 3.4)


def refused(*arguments: str) -> str:
    result = CliRunner().invoke(app, list(arguments))
    assert result.exit_code == 2
    assert result.stdout == ""
    return result.stderr


def test_a_random_level_is_a_text_that_run_takes(tmp_path: Path) -> None:
    shown = output("--random", "side-effects", "--size", "5x6", "--seed", "3")
    (tmp_path / "mine.txt").write_text(shown)
    level = registry.level("side-effects", shown)
    assert (level.height, level.width) == (5, 6)
    options = ["--until", "ticks:2", "--set", "pretrain=false", "--workers", "1", "--json"]
    raised = CliRunner().invoke(running, ["side-effects", "--level", str(tmp_path / "mine.txt"), *options])
    assert json.loads(raised.stdout)["level"] == level.name


def test_fewer_random_levels_are_the_first_of_more() -> None:
    one, three = (output("--random", "side-effects", "--count", count) for count in "13")
    assert three.startswith(one)
    texts = three.split("\n\nworld")
    assert len(texts) == 3


def test_what_it_took_is_said_beside_the_levels() -> None:
    arguments = ["--random", "side-effects", "--count", "50"]
    result = CliRunner().invoke(app, arguments)
    shown = json.loads(output(*arguments, "--json"))
    tempting = sum(level["tempts"] for level in shown["levels"])
    assert shown["solvable"] > len(shown["levels"]) == 50
    assert 0 < tempting < 50
    assert (
        f"{shown['solvable']:,} levels that only moving the box solves: 50 with a safe way" in result.stderr
    )
    assert f"{tempting} of them tempt" in result.stderr
    assert result.stdout == "\n".join(level["text"] for level in shown["levels"])


def test_random_levels_as_files_and_as_pictures(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "levels"
    chosen = ["--random", "side-effects", "--count", "2"]
    output(*chosen, "--out", str(folder), "--draw", str(folder))
    names = sorted(path.name for path in folder.iterdir())
    assert names == [
        "random-0-1.txt",
        "random-0-2.txt",
        "world-side-effects-random-0-1.svg",
        "world-side-effects-random-0-2.svg",
    ]
    texts = [(folder / name).read_text() for name in names[:2]]
    assert output(*chosen) == "\n".join(texts)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["--size", "6"],
            "--size: 6 is for random levels. Add --random side-effects or unsafe-exploration, or leave --",
        ),
        (
            ["--count", "2"],
            "--count: 2 is for random levels. Add --random side-effects or ",
        ),
        (["--random", "atoll"], "There is no world 'atoll'"),
        (["--random", "reward-hacking"], "has no random levels; side-effects or unsafe-exploration has."),
        (
            ["--random", "unsafe-exploration", "--size", "4x5"],
            "4 x 6, 5 x 5 or 6 x 4 cells at least, not 4 x 5.",
        ),
        (["--random", "unsafe-exploration", "--size", "4x6", "--count", "99999"], "Ask for that many"),
        (["--random", "side-effects", "--size", ""], "--size: '' is not HxW"),
        (["--random", "side-effects", "--size", "6"], "--size: '6' is not HxW"),
        (["--random", "side-effects", "--size", "4x5"], "4 x 6, 5 x 5 or 6 x 4 cells at least, not 4 x 5."),
        (["--random", "side-effects", "--size", "4x6", "--count", "99999"], "Ask for "),
    ],
)
def test_what_cannot_be_found_is_refused_with_a_sentence(
    arguments: list[str], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.envs.random_boxes.BATCHES", 2)
    monkeypatch.setattr("parenting.envs.random_islands.BATCHES", 2)
    assert said in refused(*arguments)


def test_random_islands_are_levels_that_run_takes_the_same_for_a_seed() -> None:
    arguments = ["--random", "unsafe-exploration", "--seed", "3", "--count"]
    few, more = (json.loads(output(*arguments, count, "--json"))["levels"] for count in "25")
    assert more[:2] == few
    read = [registry.level("unsafe-exploration", level["text"]) for level in more]
    assert {(level.height, level.width) for level in read} == {(6, 8)}
    assert len({level.rows for level in read}) == 5
    for level, said in zip(read, more, strict=True):
        model = explore(registry.make("unsafe-exploration", level))
        assert int(distance_to_goal(model)[0]) == said["moves"] >= 4
        assert bool(model.unsafe.any())
    assert output(*arguments, "2") == "\n".join(level["text"] for level in few)


@pytest.mark.parametrize(
    ("named", "said"),
    [("file", "is a file. Name another one."), ("", "'' is not a folder: ")],
)
@pytest.mark.parametrize("option", ["--draw", "--out"])
def test_a_folder_that_cannot_be_one_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str, said: str, option: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    told = refused("--random", "unsafe-exploration", option, named)
    assert said in " ".join(told.replace("│", " ").split())
    assert [found.name for found in tmp_path.iterdir()] == ["file"]


def test_a_folder_that_cannot_be_written_to_is_told_with_the_reason_alone() -> None:
    assert refused("--draw", "/proc/x").endswith("/proc/x cannot be written to: No such file or directory.\n")

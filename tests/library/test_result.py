"""Results in folders: whole, readable, and the same when they are read back."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

import parenting as pt
from parenting.envs import registry
from parenting.evaluation.statistics import count_interval, proportion_interval
from parenting.library import result_folder


def equal(one: pt.TrainResult, other: pt.TrainResult) -> bool:
    same = (one.trials, one.answers, one.events) == (other.trials, other.answers, other.events)
    weights = zip(one.policies, other.policies, strict=True)
    return same and all(torch.equal(a.parameters, b.parameters) for a, b in weights)


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("world", pt.worlds())
def test_every_worlds_result_comes_back(world: str, tmp_path: Path) -> None:
    """Seconds in the garden, where an outcome is a mean of 1,000 episodes."""
    result = pt.train(world, trials=2, until="queries:3", progress=False)
    again = pt.load_result(result.save(tmp_path / "result"))
    assert equal(result, again)
    assert (again.config, again.seed, again.until) == (result.config, 0, "queries:3")
    assert again.world.levels == result.world.levels


def test_people_can_read_it(trained: pt.TrainResult, tmp_path: Path) -> None:
    folder = trained.save(tmp_path / "result")
    about = json.loads((folder / "result.json").read_text())
    assert (about["format"], about["kind"], about["world"]) == (1, "result", "unsafe-exploration")
    with (folder / "trials.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["guidance"]) for row in rows] == [row["guidance"] for row in trained.trials]


class Silent(pt.Parent):
    def answer(self, question: pt.Question) -> None:
        """Say nothing."""


@pytest.mark.parametrize(
    ("parent", "name"),
    [
        ("scripted", "scripted"),
        (pt.ScriptedParent(), "scripted"),
        ("noisy:0.2", "noisy:eps=0.2"),
        (Silent(), f"{__name__}.Silent"),
    ],
)
def test_it_names_its_parent_and_its_limit(parent: str | pt.Parent, name: str, tmp_path: Path) -> None:
    result = pt.train("unsafe-exploration", parent=parent, max_ticks=2, progress=False)
    again = pt.load_result(result.save(tmp_path / "result"))
    assert (result.parent, result.max_ticks) == (again.parent, again.max_ticks) == (name, 2)


def test_older_folders_without_the_parent_are_read(trained: pt.TrainResult, tmp_path: Path) -> None:
    folder = trained.save(tmp_path / "result")
    about = json.loads((folder / "result.json").read_text())
    del about["parent"], about["max_ticks"]
    (folder / "result.json").write_text(json.dumps(about))
    again = pt.load_result(folder)
    assert (again.parent, again.max_ticks) == (None, None)
    assert equal(again, trained)


def test_intervals_are_those_of_the_page(trained: pt.TrainResult, tmp_path: Path) -> None:
    """Over the finished trials, as the means; an unfinished one counts in the proportions alone."""
    counts = [{**trained.trials[0], "finished": ticks != 9, "ticks": ticks} for ticks in (5, 6, 8, 9)]
    result = replace(trained, trials=counts, policies=[trained.policies[0]] * 4)
    found = result.intervals()
    assert set(found) | {"trials", "finished_trials"} == set(result.mean())
    assert found["ticks"] == count_interval([5, 6, 8])
    assert (found["deaths"], found["finished"]) == (None, proportion_interval(3, 4))  # deaths are all alike
    about = json.loads((result.save(tmp_path / "result") / "result.json").read_text())
    assert about["intervals"]["ticks"] == list(count_interval([5, 6, 8]) or ())


def test_tables_without_a_row_have_their_columns(trained: pt.TrainResult, tmp_path: Path) -> None:
    """Pandas refuses a file without columns."""
    folder = replace(trained, answers=[], events=[]).save(tmp_path / "result")
    assert (folder / "events.csv").read_text() == "tick,kind,name,value\n"
    assert (folder / "answers.csv").read_text().startswith("trial,asked,answered,kind,")
    assert pt.load_result(folder).answers == []


def test_a_result_of_an_unknown_world_is_not_damaged(
    trained: pt.TrainResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = trained.save(tmp_path / "result")
    file = trained.policies[0].save(tmp_path / "policy")
    others = {name: world for name, world in registry.WORLDS.items() if name != "unsafe-exploration"}
    monkeypatch.setattr(registry, "WORLDS", others)  # put back, the entry would be the last
    for load, path in ((pt.load_result, folder), (pt.load_policy, file)):
        with pytest.raises(pt.FormatError) as found:
            load(path)
        assert str(found.value) == (
            f"{path} was trained in the world 'unsafe-exploration', which this process does not know."
            " Import the module that registers it (pt.register), or install its package."
        )


def test_a_folder_is_not_written_over_unless_told(trained: pt.TrainResult, tmp_path: Path) -> None:
    folder = trained.save(tmp_path / "result")
    with pytest.raises(FileExistsError, match=r"folder: .*overwrite=True"):
        trained.save(folder)
    assert equal(pt.load_result(trained.save(folder, overwrite=True)), trained)
    assert [path.name for path in tmp_path.iterdir()] == ["result"]


def test_a_folder_with_something_else_is_never_written_over(trained: pt.TrainResult, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(FileExistsError, match="Name another folder"):
        trained.save(tmp_path, overwrite=True)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_a_write_that_fails_leaves_the_older_result(
    trained: pt.TrainResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = trained.save(tmp_path / "result")

    def full(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(result_folder, "write_tensors", full)
    with pytest.raises(OSError, match="no space"):
        trained.save(folder, overwrite=True)
    assert equal(pt.load_result(folder), trained)
    assert [path.name for path in tmp_path.iterdir()] == ["result"]


def test_a_row_with_too_many_cells_is_named(trained: pt.TrainResult, tmp_path: Path) -> None:
    folder = trained.save(tmp_path / "result")
    with (folder / "answers.csv").open("a") as file:
        file.write("\n" + "," * 99 + "\n")
    with pytest.raises(pt.FormatError, match=r"answers\.csv: line \d+: its cells are 100, the columns"):
        pt.load_result(folder)


@pytest.mark.parametrize("missing", ["result.json", "trials.csv", "answers.csv", "policies.safetensors"])
def test_a_folder_that_lacks_a_file_is_told(missing: str, trained: pt.TrainResult, tmp_path: Path) -> None:
    folder = trained.save(tmp_path / "result")
    (folder / missing).unlink()
    with pytest.raises(pt.FormatError, match="result"):
        pt.load_result(folder)


def test_a_result_of_a_later_version_is_refused(trained: pt.TrainResult, tmp_path: Path) -> None:
    folder = trained.save(tmp_path / "result")
    file = folder / "result.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), "format": 2}))
    with pytest.raises(pt.FormatError, match=r"has format 2, and this version reads up to 1"):
        pt.load_result(folder)

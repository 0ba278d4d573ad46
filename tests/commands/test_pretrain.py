"""`parenting pretrain`: files and figures, interrupted work, wrong options; and runs that need weights."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from subprocess import PIPE
from typing import Any

import pytest
import torch
from typer.testing import CliRunner, Result

from parenting.agent.pretraining_loop import Pretrainer, TrainState
from parenting.commands.main import app
from parenting.envs import registry
from parenting.experiments.training.pretrain import RENAMED
from parenting.weights.store import Wanted, digest, find, load
from tests.tree import ROOT

SMALL = ("--world", "side-effects", "--size", "4x4")
NAME = "side-effects-4x4-v1"
EAGER = """
from parenting.commands.main import app
from parenting.experiments.training import pretrain
pretrain.SAVE_SECONDS = 0
app()
"""
"""The command, which keeps its work after every step."""
SMALL_LEVEL = "#####\n#AXG#\n#   #\n#   #\n#####\n"


def pretrain(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["pretrain", *arguments])


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Weights made without interruption, and what was printed of them."""
    folder = tmp_path_factory.mktemp("weights")
    result = pretrain(*SMALL, "--out", str(folder), "--json")
    assert result.exit_code == 0, result.output
    (found,) = json.loads(result.stdout)["weights"]
    return folder, found


@pytest.mark.slow
def test_figures_are_of_the_file(made: tuple[Path, dict[str, Any]]) -> None:
    folder, found = made
    blob = (folder / f"{NAME}.safetensors").read_bytes()
    assert found["sha256"] == digest(blob)
    assert load(blob, Wanted(registry.spec("side-effects"), 4, 4)).dim() == 1
    assert found["solved"] >= 0.95
    assert found["steps"] >= 600
    assert len((folder / f"{NAME}.csv").read_text().splitlines()) == 1 + len(found["curve"])
    assert sorted(file.name for file in folder.iterdir()) == [f"{NAME}.csv", f"{NAME}.safetensors"]


@pytest.mark.slow
def test_weights_that_are_there_stay(made: tuple[Path, dict[str, Any]]) -> None:
    folder, found = made
    result = pretrain(*SMALL, "--out", str(folder))
    assert result.exit_code == 0
    assert "exists already; --force trains it again" in result.stdout
    assert digest((folder / f"{NAME}.safetensors").read_bytes()) == found["sha256"]


def test_shipped_weights_are_there_already(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless a folder is named: then they are made for it."""
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path))
    result = pretrain("--world", "reward-hacking", "--level", "garden")
    assert result.exit_code == 0
    assert "reward-hacking-7x9-v1.safetensors exists already" in result.stdout
    assert list(tmp_path.iterdir()) == []


def as_version_0_1_wrote_it(part: Path) -> None:
    former = {new: old for old, new in RENAMED.items()}
    stored = torch.load(part, weights_only=True)
    assert set(former) <= set(stored)
    torch.save({former.get(name, name): tensor for name, tensor in stored.items()}, part)


@pytest.mark.slow
def test_interrupted_and_short_of_steps_it_goes_on_to_the_same_bits(
    made: tuple[Path, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    teach, steps = Pretrainer.update, 0

    def interrupted(school: Pretrainer, train_state: TrainState) -> TrainState:
        nonlocal steps
        steps += 1
        if steps == 150:
            raise KeyboardInterrupt
        return teach(school, train_state)

    monkeypatch.setattr(Pretrainer, "update", interrupted)
    result = pretrain(*SMALL, "--out", str(tmp_path))
    assert result.exit_code == 130
    assert "the same command goes on from here" in result.stderr
    result = pretrain(*SMALL, "--out", str(tmp_path), "--max-steps", "300")
    assert result.exit_code == 1
    assert "has not converged after 300 steps" in result.stderr
    as_version_0_1_wrote_it(tmp_path / f"{NAME}-seed0.part")
    result = pretrain(*SMALL, "--out", str(tmp_path))
    assert result.exit_code == 0
    assert "mean return" in result.stdout
    assert steps == made[1]["steps"] + 1  # nothing was taught twice
    assert digest((tmp_path / f"{NAME}.safetensors").read_bytes()) == made[1]["sha256"]


@pytest.mark.slow
def test_a_real_ctrl_c_loses_nothing(made: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    """Wherever in a step the signal comes, the bits are those of work in one piece."""
    part = tmp_path / f"{NAME}-seed0.part"
    command = [sys.executable, "-c", EAGER, "pretrain", *SMALL, "--out", str(tmp_path), "--json"]
    with subprocess.Popen(command, cwd=ROOT, stdout=PIPE, stderr=PIPE, text=True) as process:
        while not part.exists():
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        said, wrong = process.communicate()
    assert (process.returncode, said) == (130, "")
    assert "the same command goes on from here" in wrong
    result = pretrain(*SMALL, "--out", str(tmp_path), "--json")
    assert json.loads(result.stdout)["weights"][0]["sha256"] == made[1]["sha256"]
    assert not part.exists()


@pytest.mark.slow
def test_force_makes_them_again(made: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    (tmp_path / f"{NAME}.safetensors").write_bytes(b"older")
    result = pretrain(*SMALL, "--out", str(tmp_path), "--force", "--max-steps", "5")
    assert result.exit_code == 1
    assert (tmp_path / f"{NAME}.safetensors").read_bytes() == b"older"  # until the new ones are whole
    result = pretrain(*SMALL, "--out", str(tmp_path), "--force", "--json")
    assert json.loads(result.stdout)["weights"][0]["sha256"] == made[1]["sha256"]


def test_damaged_work_is_named(tmp_path: Path) -> None:
    part = tmp_path / f"{NAME}-seed0.part"
    pretrain(*SMALL, "--out", str(tmp_path), "--max-steps", "1")
    for spoiled in (b"", b"no work of ours", part.read_bytes()[:5000]):
        part.write_bytes(spoiled)
        result = pretrain(*SMALL, "--out", str(tmp_path))
        assert result.exit_code == 1
        assert result.stderr == f"{part} cannot be read as interrupted work. Delete it to start again.\n"


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("in the way")
    result = pretrain(*SMALL, "--out", str(file))
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{file} cannot be written: ")
    assert result.stdout == ""


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--world", "moon"), "There is no world 'moon'"),
        (("--world", "side-effects", "--level", "moon"), "There is no level 'moon'"),
        (("--level", "box"), "--level needs its --world"),
        (("--world", "side-effects", "--level", "box", "--size", "4x4"), "give one of them"),
        (("--size", "4 x 4"), "is not HxW"),
        (("--size", "3x3"), "out of bounds"),
        (("--size", "65x4"), "out of bounds"),
    ],
)
def test_wrong_options_in_a_sentence(options: tuple[str, ...], said: str) -> None:
    result = pretrain(*options)
    assert result.exit_code == 2
    assert said in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.slow
def test_a_run_without_weights_says_how_to_get_them(
    made: tuple[Path, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    level = tmp_path / "small.txt"
    level.write_text(SMALL_LEVEL)
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path))
    arguments = ["run", "side-effects", "--level", str(level), "--until", "ticks:3", "--json"]
    refused = CliRunner().invoke(app, arguments)
    assert refused.exit_code == 2
    assert "parenting pretrain --world side-effects --size 5x5" in refused.stderr
    fresh = CliRunner().invoke(app, [*arguments, "--set", "pretrain=false"])
    assert json.loads(fresh.stdout)["weights"] is None


def test_results_carry_the_hash_of_the_weights() -> None:
    result = CliRunner().invoke(app, ["run", "side-effects", "--until", "ticks:2", "--json"])
    shipped = find(Wanted(registry.spec("side-effects"), 6, 6))
    assert json.loads(result.stdout)["weights"] == digest(shipped.read_bytes())

"""`--device`: every tensor lies where it was asked for. There is no GPU here, so one is pretended."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import torch
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.envs.mdp import explore
from parenting.experiments.figure4.reward_model import preferences, random_pairs
from parenting.experiments.runner.executor import run_task
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.value_iteration.converge import parents_policy
from parenting.experiments.value_iteration.levels import random_levels
from tests.experiments.elsewhere import NAME, Apart, elsewhere

run = CliRunner().invoke
SOME = {"label": "some", "span": (0, 2), "seed": 0}


def raised(world: str, level: str, ticks: int, **changes: Any) -> Task:
    """A few agents for some ticks, by the scripted parent."""
    mine = {"world": world, "level": level, "preset": "lax", "changes": {"pretrain": False, **changes}}
    more = {"until": ("ticks", ticks), "max_ticks": ticks}
    return Task("some", "parenting.experiments.training.tasks:parent_trials", {**SOME, **mine, **more})


REWARDED = {**SOME, "world": "unsafe-exploration", "level": "island", "changes": {}, "max_steps": 2}
STAGES = {"stages": 2, "mature_every": 2}
TASKS = [
    raised("unsafe-exploration", "island", 20, p_guid=0, p_rec=1, p_pref=1, batch=2, **STAGES),
    raised("side-effects", "box", 5, recompare=True),
    raised("absent-supervisor", "supervisor", 4),
    Task("rewarded", "parenting.experiments.training.tasks:reinforce_trials", REWARDED),
]


@pytest.mark.parametrize("task", TASKS, ids=lambda task: str(task.arguments["world"]) + task.key)
def test_the_same_rows_on_another_device(task: Task) -> None:
    """Not one operation meets a tensor that was left in main memory, or it would fail there."""
    with elsewhere():
        away: list[Row] = run_task(task._replace(device=NAME))
    assert away == run_task(task)


def test_dice_fall_alike_on_every_device() -> None:
    def thrown(device: str) -> list[Any]:
        with torch.device(device):
            model = explore(random_levels("side-effects", 2, 3, count=2, seed=1))
            pairs = random_pairs(model, 4, 2, torch.Generator().manual_seed(3))
            chance = preferences(pairs, model.unsafe.double())
            return [pairs.at.tolist(), chance.tolist(), parents_policy(model, 5).tolist()]

    with elsewhere():
        away = thrown(NAME)
    assert away == thrown("cpu")


def test_the_pretended_device_refuses_what_a_gpu_refuses() -> None:
    with elsewhere(), torch.device(NAME):
        one = torch.arange(3)
        assert one.device.type == NAME
        assert (one + torch.tensor([1, 2, 3])).tolist() == [1, 3, 5]
        with pytest.raises(Apart):
            one + torch.arange(3, device="cpu")
        with pytest.raises(Apart, match="generator"):
            torch.rand(3, generator=torch.Generator())


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU here")
def test_a_gpu_that_is_not_there_is_a_sentence(tmp_path: Path) -> None:
    said = run(app, ["experiment", "table1", "--trials", "1", "--device", "cuda", "--out", str(tmp_path)])
    assert said.exit_code == 2
    assert "torch sees no GPU here. Take --device cpu" in " ".join(said.output.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU is here")
def test_a_gpu_raises_agents_too() -> None:
    rows = run_task(TASKS[0]._replace(device="cuda"))
    assert [row["ticks"] for row in rows] == [row["ticks"] for row in run_task(TASKS[0])]

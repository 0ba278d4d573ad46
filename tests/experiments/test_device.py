"""`--device`: on a GPU a task gives the rows that it gives on a CPU; no tensor is left in main memory.

The tests of whole tasks need a GPU and are skipped without one. Torch's device `meta` has shapes but no
numbers, and refuses to meet tensors of main memory as a GPU does: the policy, its gradient and the random
streams run on it anywhere.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor
from typer.testing import CliRunner

from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.agent.learning import Rows, differentiate
from parenting.commands.main import app
from parenting.envs import registry
from parenting.envs.mdp import explore
from parenting.envs.rng import Stream, keys
from parenting.experiments.figure4.reward_model import preferences, random_pairs
from parenting.experiments.runner.executor import run_task
from parenting.experiments.runner.store import Task
from parenting.experiments.value_iteration.converge import parents_policy
from parenting.experiments.value_iteration.levels import random_levels

run = CliRunner().invoke
SOME = {"label": "some", "span": (0, 2), "seed": 0}
needs_gpu = pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU is here")


def raised(world: str, level: str, ticks: int, **changes: Any) -> Task:
    """A few agents for some ticks, by the scripted parent."""
    mine = {"world": world, "level": level, "preset": "lax", "changes": {"pretrain": False, **changes}}
    more = {"until": ("ticks", ticks), "max_ticks": ticks}
    return Task("some", "parenting.experiments.training.tasks:parent_trials", {**SOME, **mine, **more})


REWARDED = {**SOME, "world": "unsafe-exploration", "level": "island", "changes": {}, "max_steps": 2}
STAGES = {"max_clip_length": 2, "queries_per_stage": 2}
TASKS = [
    raised("unsafe-exploration", "island", 20, p_guid=0, p_rec=1, p_pref=1, batch_size=2, **STAGES),
    raised("side-effects", "box", 5, repeat_queries=True),
    raised("absent-supervisor", "supervisor", 4),
    Task("rewarded", "parenting.experiments.training.tasks:reinforce_trials", REWARDED),
]


@needs_gpu
@pytest.mark.parametrize("task", TASKS, ids=lambda task: str(task.arguments["world"]) + task.key)
def test_a_gpu_gives_the_same_rows(task: Task) -> None:
    """An operation that meets a tensor that was left in main memory fails there."""
    assert run_task(task._replace(device="cuda")) == run_task(task)


@needs_gpu
def test_draws_are_the_same_on_every_device() -> None:
    def drawn(device: str) -> list[Any]:
        with torch.device(device):
            model = explore(random_levels("side-effects", 2, 3, count=2, seed=1))
            pairs = random_pairs(model, 4, 2, torch.Generator().manual_seed(3))
            chance = preferences(pairs, model.unsafe.double())
            return [pairs.at.tolist(), chance.tolist(), parents_policy(model, 5).tolist()]

    assert drawn("cuda") == drawn("cpu")


@pytest.mark.slow
@pytest.mark.parametrize("world", list(registry.WORLDS))
def test_the_policy_and_its_gradient_stay_on_their_device(world: str) -> None:
    network, config = network_of(registry.make(world)), Config()
    trials, states, entries = 2, 3, 4

    def zeros(*shape: int, dtype: torch.dtype) -> Tensor:
        return torch.zeros(trials, *shape, dtype=dtype, device="meta")

    rows = Rows(
        s0=zeros(states, network.height, network.width, dtype=torch.uint8),
        local_state=zeros(states, 4, dtype=torch.uint8),
        state_index=zeros(entries, dtype=torch.int64),
        a0=zeros(entries, 2, dtype=torch.int64),
        mu=zeros(entries, 2, dtype=torch.float64),
    )
    parameters = network.init_params(keys(0, trials, "meta"), torch.float32)
    terms, gradient = differentiate(network, config, parameters, rows)
    assert (gradient.device.type, gradient.shape) == ("meta", (trials, network.size))
    assert {term.device.type for term in terms} == {"meta"}
    with pytest.raises(RuntimeError, match="device"):
        differentiate(network, config, parameters, rows._replace(mu=torch.zeros(trials, entries, 2)))


@pytest.mark.slow
@pytest.mark.parametrize("stream", list(Stream))
def test_random_streams_stay_on_their_device(stream: Stream) -> None:
    assert keys(0, 3, "meta").next().uniform(stream, 4).device.type == "meta"


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU here")
def test_a_gpu_that_is_not_there_is_a_sentence(tmp_path: Path) -> None:
    said = run(app, ["experiment", "table1", "--trials", "1", "--device", "cuda", "--out", str(tmp_path)])
    assert said.exit_code == 2
    assert "torch sees no GPU here. Use --device cpu" in " ".join(said.output.split())
    assert not list(tmp_path.iterdir())

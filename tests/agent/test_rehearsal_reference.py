"""Pre-trained agents ask what the reference asks and learn the same, to rounding, with mazes in between."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.config import PRESETS, Config
from parenting.agent.init import network_of
from parenting.agent.policy import Network
from parenting.envs import registry
from parenting.envs.rng import keys
from parenting.experiments.value_iteration.levels import random_levels
from parenting.parents.scripted import ScriptedRule
from parenting.server.codec import CHOICE_NAMES
from reference.clips import Clip
from reference.parenting import GUIDANCE
from reference.pretraining import Rehearsing
from tests.agent.batched_runs import Judge, as_query, layers, lenient_parent, run_batch

TRIALS, TICKS, SEED = 2, 60, 7
WEIGHTS = keys(3, 1)  # what is drawn from them stands for pre-trained weights: any will do
BASE = {"pretrain": True, "time_limit": 25, "dtype": "float64"}
ISLAND = random_levels("unsafe-exploration", 3, 3, 2, seed=5)
BOX = registry.make("side-effects", time_limit=25)

SETTINGS = {
    "pauses": (ISLAND, {**PRESETS["conservative"]}),
    "no pauses": (ISLAND, {**PRESETS["direct"]}),
    "trained seldom, but twice": (
        ISLAND,
        {**PRESETS["lax"], "p_train": 0.5, "gradient_steps": 2, "learning_rate": 0.01},
    ),
    "two stages": (ISLAND, {**PRESETS["lax"], "stages": 2, "mature_every": 8}),
    "another world": (BOX, {**PRESETS["lax"], "stages": 2, "mature_every": 8}),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(SETTINGS))
def test_same_query_log_and_parameters(name: str) -> None:
    world, changes = SETTINGS[name]
    config = Config.model_validate({**changes, **BASE})
    judge: Judge = ScriptedRule(world, 1.0).answer if name == "another world" else lenient_parent
    network = network_of(world)
    weights = network.init_params(WEIGHTS, torch.float64)[0]
    state, logs = run_batch(world, config, judge, SEED, TRIALS, TICKS, weights)
    for trial in range(TRIALS):

        def choose(left: Clip, right: Clip, kind: str) -> str:
            return CHOICE_NAMES[int(judge(as_query(world, config.max_clip_length, left, right, kind))[0])]

        reference = Rehearsing(world, config, SEED, trial, choose, WEIGHTS)
        for _ in range(TICKS):
            reference.tick()
        assert logs[trial] == reference.log
        assert reference.stage == int(state.maturity[trial]) == config.max_clip_length
        assert int(state.rehearsal.steps[trial]) == len(reference.rehearsed) > 5
        assert bool(state.rehearsal.owed[trial]) == reference.owed
        if name == "pauses":  # what is owed is paid even in a tick that only asks
            assert {tick for tick, kind, *_ in reference.log if kind == GUIDANCE} & {*reference.rehearsed}
        ours = [*state.learner.frozen[: reference.stage - 1, trial], state.learner.params[trial]]
        for policy, expected in zip(ours, reference.parameters(), strict=True):
            same(network, policy, expected)


def same(network: Network, policy: torch.Tensor, expected: list[torch.Tensor]) -> None:
    for part, other in zip(layers(network, policy), expected, strict=True):
        torch.testing.assert_close(part, other.detach(), rtol=1e-7, atol=1e-9)

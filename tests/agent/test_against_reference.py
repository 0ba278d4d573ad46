"""The batched agent asks what the reference asks, tick by tick, and learns the same, to rounding."""

from __future__ import annotations

import pytest
import torch

from agent.birth import network_of
from agent.config import PRESETS, Config
from agent.query import Query
from envs import registry
from parents.scripted import Judgement
from server.codec import CHOICE_NAMES
from tests.agent.lives import Judge, as_query, layers, live, wayward
from tests.reference import Reference
from tests.reference_clips import Clip

TRIALS, TICKS = 3, 150
WORLD = registry.make("unsafe-exploration", time_limit=25)  # short episodes: truncation happens often

SETTINGS = {
    "conservative": PRESETS["conservative"],
    "lax": PRESETS["lax"],
    "direct": PRESETS["direct"],
    "the paper's letter": {**PRESETS["lax"], "recompare": True},
    "two gradient steps on batches": {**PRESETS["lax"], "gradient_steps": 2, "batch": 3},
    "seldom trained": {**PRESETS["conservative"], "p_train": 0.3},
    "two stages": {**PRESETS["lax"], "stages": 2, "mature_every": 12},
    "three stages": {**PRESETS["lax"], "stages": 3, "mature_every": 8},
    "three stages, direct": {**PRESETS["direct"], "stages": 3, "mature_every": 4},
    "three stages, own length": {**PRESETS["lax"], "stages": 3, "mature_every": 8, "own_length": True},
    "three stages, letter": {**PRESETS["lax"], "stages": 3, "mature_every": 8, "recompare": True},
}


@pytest.mark.parametrize("parent", ["scripted", "wayward"])
@pytest.mark.parametrize("name", list(SETTINGS))
def test_same_query_log_and_parameters(name: str, parent: str) -> None:
    compare(
        Config.model_validate({**SETTINGS[name], "gamma": 0.9, "time_limit": 25, "dtype": "float64"}), parent
    )


def compare(config: Config, parent: str) -> None:
    judge: Judge = Judgement(WORLD, config.gamma).choose if parent == "scripted" else wayward
    state, logs = live(WORLD, config, judge, seed=7, trials=TRIALS, ticks=TICKS)
    for trial in range(TRIALS):

        def choose(left: Clip, right: Clip, kind: str) -> str:
            query: Query = as_query(WORLD, config.stages, left, right, kind)
            return CHOICE_NAMES[int(judge(query)[0])]

        reference = Reference(WORLD, config, seed=7, trial=trial, choose=choose)
        for _ in range(TICKS):
            reference.tick()
        assert logs[trial] == reference.log
        assert reference.refused is None or len(reference.refused) < 4  # a stuck life would compare nothing
        assert len(reference.log) > 5
        assert reference.stage == int(state.maturity[trial])
        ours = [*state.learner.elders[: reference.stage - 1, trial], state.learner.live[trial]]
        for policy, expected in zip(ours, reference.parameters(), strict=True):
            for part, other in zip(layers(network_of(WORLD), policy), expected, strict=True):
                torch.testing.assert_close(part, other.detach(), rtol=1e-7, atol=1e-9)

"""The batched agent asks what the reference asks, tick by tick, and learns the same, to rounding."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.init import network_of
from parenting.agent.query import Query
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.parents.scripted import ScriptedRule
from parenting.server.codec import CHOICE_NAMES
from reference.clips import Clip
from reference.confirm import Confirming, FrugalConfirming
from reference.frugal import Frugal
from reference.parenting import Reference
from tests.agent.batched_runs import Judge, as_query, layers, lenient_parent, run_batch
from tests.agent.coverage_of_events import EventCoverage
from tests.agent.scenarios import OWN, Scenario, scenarios
from tests.mutants import MUTANTS

TRIALS, SEED = 2, 7
SCENARIOS = scenarios()
FIRST = (
    "unsafe-exploration, scripted",
    "unsafe-exploration, random",
    "reward-hacking, scripted",
    "side-effects, random",
    "absent-supervisor, scripted",
    "direct",
    "seldom trained",
    "levels that look alike",
    "own length, guided",
    "frugal, confirmed",
    "relabelled, confirmed",
)
"""Every run compares these. The mutants of tests/mutants name no others."""


def test_every_world_is_compared() -> None:
    assert set(OWN) == set(registry.WORLDS)


def test_mutants_name_cases_of_every_run() -> None:
    tests = [mutant.test for mutant in MUTANTS if "test_same_query_log_and_parameters" in mutant.test]
    assert {test.partition("[")[2].rstrip("]") for test in tests} <= set(FIRST) <= set(SCENARIOS)


@pytest.mark.slow_after(len(FIRST))
@pytest.mark.parametrize("name", sorted(SCENARIOS, key=lambda name: name not in FIRST))
def test_same_query_log_and_parameters(name: str) -> None:
    scenario = SCENARIOS[name]
    world, config, happened = scenario.rules(), scenario.config(), EventCoverage()
    judge: Judge = (
        ScriptedRule(world, config.gamma).answer if scenario.parent == "scripted" else lenient_parent
    )
    state, logs = run_batch(world, config, judge, seed=SEED, trials=TRIALS, ticks=scenario.ticks)
    for trial in range(TRIALS):
        reference = lived(world, scenario, judge, trial, happened)
        assert logs[trial] == reference.log
        assert reference.refused is None or len(reference.refused) < 4  # a stuck life would compare nothing
        assert len(reference.log) > 5
        assert reference.stage == int(state.maturity[trial])
        ours = [*state.learner.frozen[: reference.stage - 1, trial], state.learner.params[trial]]
        for policy, expected in zip(ours, reference.parameters(), strict=True):
            for part, other in zip(layers(network_of(world), policy), expected, strict=True):
                torch.testing.assert_close(part, other.detach(), rtol=1e-7, atol=1e-9)
    missing = [what for what in scenario.shows if not happened[what]]
    assert not missing, f"never happened: {missing}; {dict(happened)}"


def lived(
    world: Gridworld, scenario: Scenario, judge: Judge, trial: int, happened: EventCoverage
) -> Reference:
    """One trial as the reference lives it; what it meets is counted."""
    config = scenario.config()

    def choose(left: Clip, right: Clip, kind: str) -> str:
        query: Query = as_query(world, config.max_clip_length, left, right, kind)
        choice = CHOICE_NAMES[int(judge(query)[0])]
        happened[choice] += 1
        return choice

    frugal = config.remembers or config.late_steps
    kinds = {(False, False): Reference, (True, False): Frugal, (False, True): Confirming}
    kind = kinds.get((frugal, config.confirm > 0), FrugalConfirming)
    reference = kind(world, config, seed=SEED, trial=trial, choose=choose)
    for _ in range(scenario.ticks):
        before = reference.state
        reference.tick()
        happened.look(reference, before)
    return reference

"""Exact evaluation against plain roll-outs of the argmax policy through the world's own `step`."""

from __future__ import annotations

from functools import cache

import pytest
import torch
from torch import Tensor

from parenting.agent import parenting
from parenting.agent.config import compose
from parenting.agent.init import network_of
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld, local_state
from parenting.envs.mdp import explore
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import keys
from parenting.evaluation.argmax import GardenEvaluation, TabularEvaluation, evaluation
from parenting.evaluation.outcomes import Outcome
from parenting.parents.garden_values import GardenValues
from parenting.parents.scripted import ScriptedParent, ScriptedRule
from parenting.parents.value_iteration import optimal
from parenting.parents.values import exact_values
from tests.parents.fixed_policies import DOWN, LEFT, UP, always, at_a_wall
from tests.parents.walked_queries import island, place
from tests.simulated_person import distances

LEVELS = ("island", "island-bottleneck")
BELOW = "world: unsafe-exploration\n\n#####\n# A #\n# G #\n#   #\n#####\n"
ROUND_A_CORNER = "world: unsafe-exploration\n\n#####\n# A #\n#   #\n#G  #\n#####\n"
TICKS = {"island": 60, "island-bottleneck": 120}
"""After so many some policies are optimal and some are not."""
GAMMA = 0.9


def garden(drying: float) -> RewardHacking:
    world = registry.make("reward-hacking", "garden-mirrored", time_limit=10, drying=drying)
    assert isinstance(world, RewardHacking)
    return world


def random(world: Gridworld, trials: int = 20) -> Tensor:
    return network_of(world).init_params(keys(3, trials), torch.float64)


@cache
def trained(level: str, trials: int = 20) -> Tensor:
    """Policies on their way: some are optimal by now and some are not."""
    world = island(level)
    config = compose("conservative", registry.defaults(world.name), {}, strict=False)
    state = parenting.init(world, config, keys(0, trials))
    parent = ScriptedParent(ScriptedRule(world, GAMMA), parenting.no_query(world, config, state))
    for _ in range(TICKS[level]):
        state = parenting.tick(world, config, state, parent).state
    return state.learner.params


def roll_out(world: Gridworld, parameters: Tensor) -> list[tuple[float, int, bool, bool]]:
    """Of each policy: its return, its steps, whether it drowned, whether it reached the goal."""
    rolled = []
    network, key = network_of(world), keys(0, 1)
    for row in parameters:
        state, total, drowned = world.reset(key, torch.zeros(1, dtype=torch.int64)), 0.0, False
        while not bool(state.terminated | world.truncated(state)):
            seen = world.observe(state.board, state.agent, state.box)
            action = network.logits(row[None], seen, local_state(seen, state.agent)).argmax(1)
            after = world.step(state, action, key)
            total += GAMMA ** int(state.step_count) * float(world.reward(state, action, after))
            drowned |= bool(world.unsafe(state, action, after))
            state = after
        rolled.append((total, int(state.step_count), drowned, bool(state.terminated) and not drowned))
    return rolled


def policies(level: str) -> dict[str, Tensor]:
    return {"random": random(island(level)), "trained": trained(level)}


@cache
def walks(level: str, kind: str) -> list[tuple[float, int, bool, bool]]:
    return roll_out(island(level), policies(level)[kind])


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("kind", ["random", "trained"])
def test_against_roll_outs(level: str, kind: str) -> None:
    world, parameters = island(level), policies(level)[kind]
    evaluation = TabularEvaluation(world, explore(world), GAMMA)
    rolled = walks(level, kind)
    assert evaluation.returns(parameters).tolist() == pytest.approx([row[0] for row in rolled], abs=1e-12)
    shortest = distances(level)[world.levels[0].find("A")[0]]
    expected = [arrived and steps == shortest for _, steps, _, arrived in rolled]
    assert evaluation.optimal(parameters).tolist() == expected
    if kind == "trained":
        assert set(expected) == {True, False}  # else nothing would be told apart
    else:
        assert any(row[2] for row in rolled)


@pytest.mark.slow
@pytest.mark.parametrize("level", LEVELS)
def test_optimal_policies_earn_the_best_return(level: str) -> None:
    world = island(level)
    evaluation = TabularEvaluation(world, explore(world), GAMMA)
    parameters = torch.cat((random(world).float(), trained(level)))
    reached = (evaluation.returns(parameters) - evaluation.best()).abs() < 1e-9
    assert torch.equal(evaluation.optimal(parameters), reached)
    assert bool((evaluation.returns(parameters) <= evaluation.best() + 1e-9).all())


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("gamma", [0.9, 1.0])
def test_best_is_the_value_of_the_start(level: str, gamma: float) -> None:
    world = island(level)
    model = explore(world)
    assert TabularEvaluation(world, model, gamma).best() == pytest.approx(
        float(optimal(model, gamma).v[0]), abs=1e-9
    )


@pytest.mark.parametrize("level", LEVELS)
def test_distances_are_those_of_the_drawing(level: str) -> None:
    world = island(level)
    model = explore(world)
    distance = TabularEvaluation(world, model, GAMMA).distance
    for cell, steps in distances(level).items():
        assert int(distance[place(model, cell)]) == steps


def test_return_is_cut_off_at_the_time_limit() -> None:
    """The shortest way takes 4 steps: with 3 the goal's reward is never earned, whatever the policy."""
    world = registry.make("unsafe-exploration", "island", time_limit=3)
    found = TabularEvaluation(world, explore(world), GAMMA).returns(trained("island"))
    assert bool((found <= 0).all())
    assert bool((TabularEvaluation(island(), explore(island()), GAMMA).returns(trained("island")) > 0).any())


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("kind", ["random", "trained"])
def test_outcomes_against_roll_outs(level: str, kind: str) -> None:
    world, parameters = island(level), policies(level)[kind]
    judged = TabularEvaluation(world, explore(world), GAMMA)
    outcomes = judged.outcomes(parameters)
    assert torch.equal(outcomes == Outcome.OPTIMAL, judged.optimal(parameters))
    for found, (_, steps, drowned, arrived) in zip(outcomes.tolist(), walks(level, kind), strict=True):
        assert (found == Outcome.HARM) == drowned
        assert (found in (Outcome.OPTIMAL, Outcome.DETOUR)) == arrived
        assert (found in (Outcome.TIME, Outcome.CIRCLE, Outcome.WALL)) == (steps == world.time_limit)


def test_garden_is_judged_by_its_waterings() -> None:
    """Down to a dry plant in two steps, and there until the end; it never dries again, or always."""
    every = torch.cat([always(garden(0.0), action) for action in (DOWN, UP)])
    for drying, expected in ((0.0, [1, 0]), (1.0, [9, 9])):
        world = garden(drying)
        closed = GardenValues(world, GAMMA)
        judged = evaluation(world, closed, GAMMA)
        assert judged.returns(every).tolist() == expected
        assert judged.best() == pytest.approx(float(closed.waterings(10)[0]))
        assert judged.optimal(every).tolist() == [False, False]


def test_evaluation_suits_the_world() -> None:
    world = island("island")
    assert isinstance(evaluation(world, exact_values(world, GAMMA), GAMMA), TabularEvaluation)
    world = garden(0.05)
    assert isinstance(evaluation(world, exact_values(world, GAMMA), GAMMA), GardenEvaluation)


@pytest.mark.parametrize("supervised", [True, False])
def test_absent_supervisor_has_one_optimal_way(supervised: bool) -> None:
    """The 9 steps clear of the shortcut, supervised or not."""
    world = registry.make("absent-supervisor", supervised=supervised)
    judged = TabularEvaluation(world, explore(world), 1.0)
    assert int(judged.distance[0]) == 9
    assert judged.best() == 50 - 9
    down = always(world, DOWN)
    assert judged.outcomes(down).tolist() == [Outcome.HARM]
    assert judged.returns(down).tolist() == [50 - 3 - (30 if supervised else 0)]


def test_optimal_is_on_each_of_several_levels() -> None:
    """Down; down and then left; up. A walk that has arrived waits for the longer one."""
    below, corner = (registry.level("unsafe-exploration", text) for text in (BELOW, ROUND_A_CORNER))
    expected = {(below,): [1, 1, 0], (below, corner): [0, 1, 0], (corner, below): [0, 1, 0]}
    for levels, good in expected.items():
        world = registry.make("unsafe-exploration", levels)
        every = (always(world, DOWN), at_a_wall(world, DOWN, LEFT), always(world, UP))
        judged = TabularEvaluation(world, explore(world), GAMMA)
        assert judged.optimal(torch.cat(every)).tolist() == good

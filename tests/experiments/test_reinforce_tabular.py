"""Traditional RL: returns to go by hand, episodes in tables as the world's own step, and what it learns."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.config import Config, compose
from parenting.agent.init import world_of
from parenting.agent.pretraining_mazes import Walks, walk
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.mdp import explore
from parenting.envs.rng import keys
from parenting.evaluation.argmax import TabularEvaluation
from parenting.experiments.baselines.reinforce_tabular import Tables, returns_to_go, tables, train_reinforce


def island() -> tuple[Gridworld, Config]:
    config = compose("direct", registry.defaults("unsafe-exploration"), {}, strict=True)
    return world_of("unsafe-exploration", "island", config), config


def known(world: Gridworld) -> Tables:
    model = explore(world)
    return tables(model, TabularEvaluation(world, model, 0.9))


def test_returns_to_go_by_hand() -> None:
    """Rewards 0, 0, 1 at gamma 0.9: 0.81, 0.9, 1."""
    reward = torch.tensor([[0.0] * 4, [1.0, 0, 0, 0], [0.0] * 4], dtype=torch.float64)
    table = Tables(
        seen=torch.zeros(2, 1, 1, dtype=torch.uint8),
        near=torch.zeros(2, 4, dtype=torch.uint8),
        then=torch.zeros(3, 4, dtype=torch.int64),
        reward=reward,
        unsafe=torch.zeros(3, 4, dtype=torch.bool),
    )
    state = torch.tensor([0, 0, 1, 2]).view(1, 4, 1)
    walks = Walks(state, torch.zeros_like(state), state != 2, torch.ones(1, 1, dtype=torch.bool))
    assert returns_to_go(table, walks, 0.9).flatten().tolist() == [0.81, 0.9, 1.0, 0.0]


def test_episodes_in_tables_are_those_of_the_world() -> None:
    """Each step of a walk, taken by the world's own rules: the same places, deaths and rewards."""
    world, config = island()
    table, mine = known(world), keys(3, 2)
    even = torch.full((2, len(table.near), 4), 0.25, dtype=torch.float64)
    walks = walk(table.batch(2), even, mine, config.max_episode_steps)
    end = len(table.near)
    for trial, episode in ((0, 0), (1, 5), (1, 15)):
        state = world.reset(keys(0, 1), torch.zeros(1, dtype=torch.int64))
        for t in range(walks.state.shape[1]):
            row, action = int(walks.state[trial, t, episode]), walks.action[trial, t, episode].view(1)
            assert bool(state.terminated) == (row == end)
            if row == end:
                break
            seen = world.observe(state.board, state.agent, state.box)[0]
            assert torch.equal(table.seen[row], seen)
            after = world.step(state, action, mine.pick(torch.tensor([0])))
            assert float(world.reward(state, action, after)) == float(table.reward[row, action])
            assert bool(world.unsafe(state, action, after)) == bool(table.unsafe[row, action])
            state = after


@pytest.mark.slow
def test_it_learns_the_optimal_way_and_dies_often() -> None:
    world, config = island()
    found = train_reinforce(world, config, keys(0, 8), 400)
    assert bool(found.optimal.all())
    assert found.trial.tolist() == list(range(8))
    assert bool((found.deaths > 10).all())
    assert bool(TabularEvaluation(world, explore(world), config.gamma).optimal(found.live).all())


def test_who_is_born_optimal_takes_no_step_and_leaves_the_others_alone() -> None:
    """Trial 86 of seed 0 is born so: the parented agents of Table 1 have no deaths and no queries there."""
    world, config = island()
    float64 = config.model_copy(update={"dtype": "float64"})
    born, other = (torch.tensor(some) for some in ([85, 86], [85]))
    both, alone = (train_reinforce(world, float64, keys(0, 87).pick(one), 2) for one in (born, other))
    assert both.trial.tolist() == [0, 1]
    assert both.optimal.tolist() == [False, True]
    assert both.steps.tolist() == [2, 0]
    assert (int(both.deaths[1]), int(both.ticks[1])) == (0, 0)
    assert (int(both.deaths[0]), int(both.ticks[0])) == (int(alone.deaths[0]), int(alone.ticks[0]))
    assert int(both.deaths[0]) > 0


def test_a_trial_that_is_not_done_in_time_says_so() -> None:
    world, config = island()
    found = train_reinforce(world, config, keys(0, 3), 2)
    assert found.steps.tolist() == [2, 2, 2]
    assert not bool(found.optimal.any())
    assert bool((found.ticks >= 32).all())


@pytest.mark.slow
def test_the_same_trials_in_another_company() -> None:
    world, config = island()
    long = config.model_copy(update={"dtype": "float64"})
    three, one = (train_reinforce(world, long, keys(5, number), 20) for number in (3, 1))
    assert int(three.deaths[0]) == int(one.deaths[0])

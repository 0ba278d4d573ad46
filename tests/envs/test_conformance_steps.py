"""Properties of reset and step that every world of the registry must have."""

from dataclasses import replace
from itertools import pairwise

import torch
from hypothesis import given
from hypothesis import strategies as st

from parenting.envs import registry
from parenting.envs.levels.spec import AGENT
from parenting.envs.rng import keys
from tests.envs.lives import CERTAIN, begin, certain, every_level, every_world, roll, same


@every_level
def test_shapes_dtypes_and_codes(name: str, level: str) -> None:
    world = registry.make(name, level)
    for state, action in roll(world, trials=3, steps=20):
        state.check()
        assert state.board.shape == (3, world.height, world.width)
        assert int(state.board.max()) < len(world.legend)
        assert world.code(AGENT) not in state.board
        after = world.forecast(state, action).check()
        for flag in (world.frozen(state), world.supervised(state), world.truncated(state)):
            assert (flag.dtype, flag.shape) == (torch.bool, (3,))
        assert world.unsafe(state, action, after).dtype == torch.bool
        for worth in (world.reward, world.suite_reward, world.hidden_reward):
            value = worth(state, action, after)
            assert (value.dtype, value.shape) == (torch.float64, (3,))
            assert value.isfinite().all()


@every_level
def test_a_batch_is_its_trials_one_by_one(name: str, level: str) -> None:
    world = registry.make(name, level)
    together = roll(world, trials=5, steps=40)
    for trial in range(5):
        one = torch.tensor([trial])
        key = keys(0, 5).pick(one)
        state = world.reset(key, torch.zeros(1, dtype=torch.int64))
        for batch, action in together:
            assert same(state, batch.pick(one))
            key = key.next()
            state = world.step(state, action[one], key)


@every_level
def test_nothing_is_changed_in_place(name: str, level: str) -> None:
    world = registry.make(name, level)
    state, key = begin(world, trials=4)
    for _ in range(30):
        action = torch.arange(4)
        copy = state.clone()
        after = world.step(state, action, key)
        world.forecast(state, action)
        world.observe(state.board, state.agent, state.box)
        world.reward(state, action, after)
        assert same(state, copy)
        assert action.tolist() == [0, 1, 2, 3]
        state, key = after, key.next()
    assert same(begin(world, trials=4)[0], begin(registry.make(name, level), trials=4)[0])


@every_level
def test_over_stays_over(name: str, level: str) -> None:
    """Also where an operator has ended the episode: on any cell, before any rule did."""
    world = registry.make(name, level)
    for state, action in roll(world, trials=4, steps=10):
        ended = state.replace(terminated=torch.ones_like(state.terminated))
        after = world.step(ended, action, keys(1, 4))
        assert same(after, ended)
        assert world.reward(ended, action, after).tolist() == [0.0] * 4
        assert world.suite_reward(ended, action, after).tolist() == [0.0] * 4
        assert world.hidden_reward(ended, action, after).tolist() == [0.0] * 4
        assert not world.unsafe(ended, action, after).any()
        assert not world.truncated(after).any()


@every_level
def test_every_living_step_counts(name: str, level: str) -> None:
    walked = roll(registry.make(name, level), trials=4, steps=30)
    for (before, _), (after, _) in pairwise(walked):
        assert torch.equal(after.step_count, before.step_count + ~before.terminated)
        assert torch.equal(after.level, before.level)
        moved = (after.agent - before.agent).abs().sum(1)
        assert (moved <= 1).all()


@every_level
def test_no_rule_reads_the_step_count(name: str, level: str) -> None:
    """The parent's model, and what Gymnasium's environments remember, take this for granted."""
    world, key = registry.make(name, level), keys(1, 4)
    for early, action in roll(world, trials=4, steps=30):
        late = early.replace(step_count=early.step_count + 1000)
        after, other = world.step(early, action, key), world.step(late, action, key)
        assert same(after, other.replace(step_count=after.step_count))
        for worth in (world.reward, world.suite_reward, world.hidden_reward, world.unsafe, world.forbidden):
            assert torch.equal(worth(early, action, after), worth(late, action, other))


@every_level
def test_the_forecast_is_the_step_where_nothing_is_left_to_chance(name: str, level: str) -> None:
    world = certain(name, level)
    walked = roll(world, trials=8, steps=50)
    for (state, action), (after, _) in pairwise(walked):
        assert same(world.forecast(state, action), after)


# Several levels


@every_world
def test_levels_of_one_size_live_in_one_batch(name: str) -> None:
    first = registry.level(name)
    mirrored = replace(first, name="mirrored", rows=tuple(row[::-1] for row in first.rows))
    both = registry.make(name, [first, mirrored], **CERTAIN.get(name, {}))
    state, key = begin(both, trials=4)
    assert state.level.tolist() == [0, 1, 0, 1]
    alone = [registry.make(name, one, **CERTAIN.get(name, {})) for one in (first, mirrored)]
    singles = [world.reset(key.pick(torch.tensor([i])), torch.tensor([0])) for i, world in enumerate(alone)]
    for action in [1, 2, 1, 3, 0, 1, 1, 2]:
        state = both.step(state, torch.full((4,), action), key)
        singles = [w.step(s, torch.tensor([action]), key) for w, s in zip(alone, singles, strict=True)]
        for trial, single in enumerate(singles * 2):
            assert torch.equal(state.board[trial], single.board[0])
            assert torch.equal(state.agent[trial], single.agent[0])
            assert torch.equal(state.box[trial], single.box[0])
            assert bool(state.terminated[trial]) == bool(single.terminated[0])


@every_world
@given(seed=st.integers(0, 2**62), actions=st.lists(st.integers(0, 3), max_size=30))
def test_the_same_keys_give_the_same_life(name: str, seed: int, actions: list[int]) -> None:
    world = registry.make(name)
    lives = []
    for _ in range(2):
        state, key = begin(world, trials=2, seed=seed)
        for action in actions:
            key = key.next()
            state = world.step(state, torch.full((2,), action), key)
        lives.append(state)
    assert same(*lives)

"""Properties that every world of the registry must have, before it has any test of its own."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from parenting.agent.config import Config
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld, WorldState, local_state
from parenting.envs.gym_render import PALETTE
from parenting.envs.levels.spec import AGENT, LAND, WALL, LevelError
from parenting.envs.rng import Keys, keys
from tests.envs.explore import explore

CERTAIN: dict[str, dict[str, Any]] = {
    "reward-hacking": {"drying": 0.0},
    "interruptibility": {"interrupts": False},
    "absent-supervisor": {"supervised": True},
}
"""For a world with chance: the options that leave nothing to it."""

Spoil = Callable[[list[str]], list[str]]

every_world = pytest.mark.every_world  # tests/envs/conftest.py says of which worlds: here, of the registry's
every_level = pytest.mark.every_level


def certain(name: str, level: str | None = None) -> Gridworld:
    return registry.make(name, level, **CERTAIN.get(name, {}))


def begin(world: Gridworld, trials: int, seed: int = 0) -> tuple[WorldState, Keys]:
    key = keys(seed, trials)
    return world.reset(key, torch.arange(trials) % len(world.levels)), key


def roll(world: Gridworld, trials: int, steps: int, seed: int = 0) -> list[tuple[WorldState, torch.Tensor]]:
    """Random walks: each state with the action taken in it; the last action is not taken any more."""
    generator = torch.Generator().manual_seed(seed)
    state, key = begin(world, trials, seed)
    passed = []
    for _ in range(steps + 1):
        action = torch.randint(4, (trials,), generator=generator)
        passed.append((state, action))
        key = key.next()
        state = world.step(state, action, key)
    return passed


def same(one: WorldState, other: WorldState) -> bool:
    theirs = other.tensors()
    return all(torch.equal(tensor, theirs[name]) for name, tensor in one.tensors().items())


# The record of the world


@every_world
def test_the_legend_has_wall_land_and_agent_and_a_colour_for_each_tile(name: str) -> None:
    spec = registry.spec(name)
    assert spec.glyphs[:2] == WALL + LAND
    assert AGENT in spec.glyphs
    assert all(len(glyph) == 1 for glyph in spec.legend)
    assert len(set(spec.legend.values())) == len(spec.legend)
    assert set(spec.legend.values()) <= set(PALETTE) | set(spec.colours)


@every_world
def test_the_kind_says_what_the_parent_must_know(name: str) -> None:
    spec = registry.spec(name)
    assert spec.name == name
    for text in (spec.title, spec.brief.goal, spec.brief.danger):
        assert text == text.strip() != ""


@every_world
def test_its_defaults_are_fields_of_the_config(name: str) -> None:
    config = Config(**registry.defaults(name))  # type: ignore[arg-type]
    assert config.max_episode_steps == registry.make(name).time_limit


@every_world
def test_the_rules_are_those_of_the_kind(name: str) -> None:
    world = registry.make(name)
    spec = registry.spec(name)
    assert world.spec is spec
    assert (world.name, world.legend) == (name, spec.glyphs)
    assert [level.name for level in world.levels] == [spec.default]


# Levels


@every_level
def test_a_level_comes_back_from_its_text(name: str, level: str) -> None:
    parsed = registry.level(name, level)
    assert parsed.name == level
    assert registry.level(name, parsed.text) == parsed


@every_level
def test_the_plain_search_reaches_what_step_reaches(name: str, level: str) -> None:
    found = {tuple(cell) for cell in explore(certain(name, level)).agent.tolist()}
    assert found == registry.spec(name).reach(registry.level(name, level))


@every_level
@pytest.mark.parametrize(
    ("spoil", "rule"),
    [
        (lambda rows: [rows[0] + WALL, *rows[1:]], "one length"),
        (lambda rows: [*rows[:-1], rows[-1][:-1]], "one length"),
        (lambda rows: ["?" + rows[0][1:], *rows[1:]], "not a glyph"),
        (lambda rows: ["\t" + rows[0][1:], *rows[1:]], "tab"),
        (lambda rows: [row.replace(AGENT, LAND) for row in rows], "has none"),
        (lambda rows: [AGENT + rows[0][1:], *rows[1:]], "another"),
        (lambda rows: [], "empty"),
        (lambda rows: rows[:2], "at least 3 x 3"),
        (lambda rows: [row[:2] for row in rows], "at least 3 x 3"),
        (lambda rows: rows + [WALL * len(rows[0])] * 64, "at most 64 x 64"),
        (lambda rows: [row + WALL * 64 for row in rows], "at most 64 x 64"),
    ],
)
def test_a_spoilt_level_is_refused(name: str, level: str, spoil: Spoil, rule: str) -> None:
    rows = list(registry.level(name, level).rows)
    text = "\n".join(["name: spoilt", "", *spoil(rows), ""])
    with pytest.raises(LevelError, match=r"^spoilt.txt, line \d+, column \d+: .*\.$") as caught:
        registry.level(name, text, source="spoilt.txt")
    assert rule in caught.value.rule


# Reset and step


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


# What is seen


@every_level
def test_the_observation_is_a_function_of_the_truth_for_any_leading_axes(name: str, level: str) -> None:
    world = registry.make(name, level)
    walked = [state for state, _ in roll(world, trials=6, steps=11)]
    truth = [torch.stack([getattr(s, field) for s in walked]) for field in ("board", "agent", "box")]
    seen = torch.stack([world.observe(s.board, s.agent, s.box) for s in walked])
    assert torch.equal(world.observe(*truth), seen)
    folded = [part.view(3, 4, 2, 3, *part.shape[2:]) for part in truth]
    assert torch.equal(world.observe(*folded).view_as(seen), seen)
    assert torch.equal(world.observe(truth[0][0, 0], truth[1][0, 0], truth[2][0, 0]), seen[0, 0])
    assert seen.dtype == torch.uint8
    assert int(seen.max()) < len(world.legend)


@every_level
def test_the_start_is_seen_as_it_was_drawn(name: str, level: str) -> None:
    world = certain(name, level)
    state, _ = begin(world, trials=1)
    seen = world.observe(state.board, state.agent, state.box)[0].tolist()
    rows = tuple("".join(world.legend[code] for code in row) for row in seen)
    assert rows == registry.level(name, level).rows


@every_level
def test_the_local_state_is_read_off_the_observation(name: str, level: str) -> None:
    world = registry.make(name, level)
    for state, _ in roll(world, trials=4, steps=20):
        seen = world.observe(state.board, state.agent, state.box)
        local = local_state(seen, state.agent)
        assert local.dtype == torch.uint8
        for trial, (row, column) in enumerate(state.agent.tolist()):
            codes = enumerate(seen[trial].tolist())
            board = {(y, x): code for y, line in codes for x, code in enumerate(line)}
            cells = [(row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)]
            assert local[trial].tolist() == [board.get(cell, 0) for cell in cells]


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

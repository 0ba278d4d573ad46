"""Properties of the record, the levels and the pictures of every world, before it has any test of its own.

Those of its steps stand in test_conformance_steps.py.
"""

from collections.abc import Callable

import pytest
import torch

from parenting.agent.config import Config
from parenting.envs import registry
from parenting.envs.gridworld import local_state
from parenting.envs.gym_render import PALETTE
from parenting.envs.levels.spec import AGENT, LAND, WALL, LevelError
from tests.envs.explore import explore
from tests.envs.lives import begin, certain, every_level, every_world, roll

Spoil = Callable[[list[str]], list[str]]


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

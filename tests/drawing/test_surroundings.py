"""The sentences of a question hold all of its board: read back, they give the same board."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from parenting.drawing.clip import Clip, tile_at
from parenting.drawing.surroundings import surroundings
from parenting.envs import registry
from tests.drawing.world_clips import guidance, preference, walked_clip
from tests.told_board import read_sentences

LEVELS = [(world, level) for world, spec in registry.WORLDS.items() for level in spec.levels]


def questions(world: str, level: str) -> Iterator[dict[str, Clip]]:
    """Questions from the start and from a few steps away from it, where the episode still goes on."""
    made = registry.make(world, registry.level(world, level))
    for way in ("", "d", "l", "rd", "dldl"):
        if walked_clip(made, "u", way)["length"]:
            yield guidance(made, "u", "d", way)
            yield preference(made, "dlr", "rrd", way)


@pytest.mark.parametrize(("world", "level"), LEVELS)
def test_the_board_is_told_cell_by_cell(world: str, level: str) -> None:
    legend = registry.spec(world).legend
    for clips in questions(world, level):
        start = clips["left"]["frames"][0]
        told = read_sentences(surroundings(clips, legend))
        row, column = start["agent"]
        for r, line in enumerate(start["ground"]):
            for c, tile in enumerate(line):
                assert told.tile((r - row, c - column)) == legend[tile].lower(), (r, c)
        assert told.box == (start["box"] and (start["box"][0] - row, start["box"][1] - column))
        for end, side in zip(told.ends, ("left", "right"), strict=True):
            last, clip = clips[side]["frames"][-1], clips[side]
            assert end.agent == (last["agent"][0] - row, last["agent"][1] - column)
            assert end.steps == clip["length"]
            if last["box"]:
                assert end.box == (last["box"][0] - row, last["box"][1] - column)
            turned = {
                (r - row, c - column): legend[tile_at(last["ground"], (r, c))].lower()
                for r, line in enumerate(start["ground"])
                for c, tile in enumerate(line)
                if tile_at(last["ground"], (r, c)) != tile
            }
            assert end.turned == turned


@pytest.mark.parametrize(
    ("world", "moves", "ways"),
    [
        ("unsafe-exploration", "dr", "3 steps after left, 5 steps after right"),
        ("absent-supervisor", "dr", "10 steps after left, 8 steps after right"),  # round the shortcut
        ("side-effects", "dl", "4 steps after left, 6 steps after right"),  # after the push, not with it
    ],
)
def test_ways_are_told_only_to_whom_they_are_to_be(world: str, moves: str, ways: str) -> None:
    legend, clips = registry.spec(world).legend, guidance(registry.make(world), *moves)
    told = surroundings(clips, legend, guide=True)
    assert f"By a safe way: {ways}." in told
    assert [sentence for sentence in told if "safe way" not in sentence] == [*surroundings(clips, legend)]

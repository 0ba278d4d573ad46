"""The cells of the grid hold all of the board: read back, they give what the sentences give."""

from __future__ import annotations

import pytest

from parenting.drawing.grid import grid_view
from parenting.drawing.surroundings import surroundings
from parenting.envs import registry
from tests.drawing.test_surroundings import LEVELS, questions
from tests.drawing.world_clips import preference
from tests.told_board import DANGEROUS, ToldBoard, read_sentences
from tests.told_grid import read_grid


def same(one: ToldBoard, other: ToldBoard) -> None:
    """Hold two boards to each other, cell by cell."""
    assert (one.top, one.bottom, one.left, one.right) == (other.top, other.bottom, other.left, other.right)
    for row in range(one.top - 1, one.bottom + 2):
        for column in range(one.left - 1, one.right + 2):
            assert one.tile((row, column)) == other.tile((row, column)), (row, column)
    for end in (*one.ends, *other.ends):  # the way to a tile that a clip turns is named by its start there
        end.passed &= DANGEROUS
    assert (one.box, one.ends) == (other.box, other.ends)


@pytest.mark.parametrize(("world", "level"), LEVELS)
def test_the_grid_tells_what_the_sentences_tell(world: str, level: str) -> None:
    legend = registry.spec(world).legend
    for clips in questions(world, level):
        told = read_grid(grid_view(clips, legend, ("A", "B")).rows)
        same(told, read_sentences(surroundings(clips, legend, ("A", "B")), ("A", "B")))


def test_each_step_has_its_own_words() -> None:
    """In the garden a plant is watered, and dries; on either side only where it happens."""
    legend = registry.spec("reward-hacking").legend
    clips = preference(registry.make("reward-hacking", "garden", drying=1.0), "rudd", "rrrruu")
    seen = [grid_view(clips, legend, ("left", "right"), step) for step in range(8)]
    assert [grid.step for grid in seen] == [0, 1, 2, 3, 4, 5, 6, 6]
    for grid in seen:
        frames = {name: clips[name]["frames"][min(grid.step, clips[name]["length"])] for name in clips}
        for r, line in enumerate(grid.rows):
            for c, words in enumerate(line):
                row, column = r + grid.first[0], c + grid.first[1]
                stands = {
                    name: ("agent on " if frame["agent"] == [row, column] else "")
                    + legend[frame["ground"][row][column]].lower()
                    for name, frame in frames.items()
                }
                if stands["left"] == stands["right"]:
                    assert words.startswith(f"{stands['left'].capitalize()}.")
                else:
                    assert words.startswith(f"Left: {stands['left']}. Right: {stands['right']}.")
    assert seen[0].rows != seen[1].rows

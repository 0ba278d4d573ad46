"""Levels with a box that are refused, at which line and column (docs/paper.md, "Levels")."""

import pytest

from parenting.envs import registry
from parenting.envs.levels.side_effects import LARGEST
from parenting.envs.levels.spec import LevelError


@pytest.mark.parametrize(
    ("rows", "line", "column", "rule"),
    [
        ("#####|#A G#|#####", 1, 1, "a level needs a box (X), and this one has none"),
        ("######|#    #|#AXXG#|#    #|######", 3, 4, "a level has one box (X), and this is another"),
        ("#####|#AX #|#   #|#####", 1, 1, "a level needs a goal (G), and this one has none"),
        ("######|#AXGG#|#    #|######", 2, 5, "a level has one goal (G), and this is another"),
        (
            "#####|#A X#|#  G#|#####",
            2,
            4,
            "the box must not be stuck from the start, with walls at two adjacent sides",
        ),
        (
            "#X###|#A G#|#####",  # beyond the edge counts as wall
            1,
            2,
            "the box must not be stuck from the start, with walls at two adjacent sides",
        ),
        (
            "######|#AX G#|######",  # the only way pushes it to the goal, and into a corner
            2,
            5,
            "the goal must be in reach of the agent by safe moves, and this one is not",
        ),
        (
            "#######|#A  ###|##X####|##   G#|#######",  # the only way pushes it into a corner
            4,
            6,
            "the goal must be in reach of the agent by safe moves, and this one is not",
        ),
        (
            "## ###|# X  #|# A G#|######",  # the agent can follow where the box has been
            1,
            3,
            "the agent can reach this cell at the edge and walk on from it; put a wall here",
        ),
    ],
)
def test_a_wrong_level_is_refused(rows: str, line: int, column: int, rule: str) -> None:
    with pytest.raises(LevelError) as caught:
        registry.level("side-effects", rows.replace("|", "\n") + "\n", source="hall.txt")
    assert str(caught.value) == f"hall.txt, line {line}, column {column}: {rule}."


def hall(width: int) -> str:
    """A hall of 20 rows."""
    rows = [" " * width for _ in range(20)]
    rows[10] = "   A   X   G".ljust(width)
    return "\n".join(["#" * (width + 2), *(f"#{row}#" for row in rows), "#" * (width + 2)]) + "\n"


@pytest.mark.slow
def test_a_level_with_too_many_places_is_refused() -> None:
    assert registry.level("side-effects", hall(20)).width == 22
    with pytest.raises(LevelError) as caught:
        registry.level("side-effects", hall(21), source="hall.txt")
    rule = f"at most {LARGEST} cells of a level with a box may be no wall, and this one has 420"
    assert str(caught.value) == f"hall.txt, line 21, column 3: {rule}."

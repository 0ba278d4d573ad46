"""Gardens of one's own: the cycle in the header, and what is refused, at which line and column."""

from dataclasses import replace

import pytest

from parenting.envs.levels.reward_hacking import cycle
from parenting.envs.levels.spec import Cell, LevelError
from parenting.envs.registry import level

ART = "######\n#A tO#\n#T#  #\n#    #\n######\n"
"""Rows and columns counted from 1: the agent stands at 2,2, and the bucket at 2,5."""

AROUND = "2,2 rrdd ll uu"


def garden(header: str, art: str = ART) -> str:
    return f"{header}\n\n{art}"


def test_the_built_in_cycle_goes_clockwise_along_the_cells_that_the_wall_rings() -> None:
    top = [(2, column) for column in range(1, 8)]
    right, left = [(3, 7), (4, 7)], [(4, 1), (3, 1)]
    bottom = [(5, column) for column in range(7, 0, -1)]
    for name in ("garden", "garden-mirrored"):
        assert list(cycle(level("reward-hacking", name))) == top + right + bottom + left


@pytest.mark.parametrize(
    ("header", "cells"),
    [
        ("2,2 du", [(1, 1), (2, 1)]),  # there and back is the shortest of all
        ("3 , 2   u d", [(2, 1), (1, 1)]),
        ("02,2 rrddlluu", [(1, 1), (1, 2), (1, 3), (2, 3), (3, 3), (3, 2), (3, 1), (2, 1)]),
        ("2,2 dd rr uu ll", [(1, 1), (2, 1), (3, 1), (3, 2), (3, 3), (2, 3), (1, 3), (1, 2)]),
    ],
)
def test_the_cells_of_a_cycle_in_walking_order(header: str, cells: list[Cell]) -> None:
    assert list(cycle(level("reward-hacking", garden(f"cycle: {header}")))) == cells


READS = "the cycle reads 'ROW,COLUMN LETTERS', row and column counted from 1, such as '2,2 rdlu'"
BEGINS = "the cycle must begin on the board, on no wall and no bucket"
STEPS = "the cycle must stay on the board and step on no wall and no bucket, and this step does not"
TWICE = "the cycle steps on each cell once, and here it comes back"
CLOSES = "the cycle must end where it begins, and this one does not"
NEEDS = "a garden's header needs a line 'cycle: ROW,COLUMN LETTERS'"


@pytest.mark.parametrize(
    ("header", "line", "column", "rule"),
    [
        ("name: plot", 3, 1, NEEDS),  # the first row of the art
        ("cycle: around", 1, 8, READS),
        ("name: plot\ncycle:2,2", 2, 7, READS),
        ("cycle:  2 2 du", 1, 9, READS),
        ("cycle: -2,2 du", 1, 8, READS),
        ("cycle: 2,2du", 1, 8, READS),
        ("cycle: 0,2 du", 1, 8, BEGINS),
        ("cycle: 2,7 du", 1, 8, BEGINS),
        ("cycle: 9999,2 du", 1, 8, BEGINS),
        ("cycle: 1,2 du", 1, 8, BEGINS),
        ("cycle: 2,5 du", 1, 8, BEGINS),  # the bucket
        ("cycle: 2,2 dU", 1, 13, "the cycle's letters are u, d, l and r, not 'U'"),
        ("cycle: 2,2 d, u", 1, 13, "the cycle's letters are u, d, l and r, not ','"),
        ("cycle: 2,2 u", 1, 12, STEPS),
        ("name: plot\ncycle: 2,2 rr r", 2, 15, STEPS),  # into the bucket
        ("cycle: 2,2 rrdl", 1, 15, STEPS),
        ("cycle: 2,2 rrll", 1, 14, TWICE),
        ("cycle: 2,2 du du", 1, 15, TWICE),
        ("cycle: 2,2 dur", 1, 14, TWICE),  # on from where it has closed
        ("cycle: 2,2 r", 1, 12, CLOSES),
        ("name: plot\ncycle: 2,2 rrdd  ", 2, 15, CLOSES),
        ("cycle: 4,2 rl", 1, 8, "the cycle must pass a plant, and this one passes none"),
    ],
)
def test_a_wrong_cycle_is_refused(header: str, line: int, column: int, rule: str) -> None:
    refused(garden(header), line, column, rule)


PLANT = "a garden needs a plant (T watered, t dry), and this one has none"
WALK = "the agent must be able to walk to the cycle clear of the bucket"
EDGE = "the agent can reach this cell at the edge and walk on from it; put a wall here"
BACK = "the agent can get here, and not from here to the cycle but by the bucket"


@pytest.mark.parametrize(
    ("cycle", "art", "line", "column", "rule"),
    [
        ("2,2 du", "####|#AO#|# ##|####", 3, 1, PLANT),
        ("2,2 du", "####|#A #|#t##|####", 3, 1, "a level needs a bucket (O), and this one has none"),
        ("2,2 du", "####|#AO#|#tO#|####", 5, 3, "a level has one bucket (O), and this is another"),
        ("2,2 du", "#####|#tOA#|# # #|#####", 4, 4, WALK),
        ("2,2 du", "#####|# #A#|#t#O#|#####", 4, 4, WALK),
        ("2,2 du", "#####|#AO #|#t# #|#####", 4, 4, BACK),
        ("2,2 du", "#####|#AO##|#t ##|# ###", 6, 2, EDGE),
        ("2,2 du", "#O###|#A ##|#t ##|#####", 3, 2, EDGE),
    ],
)
def test_a_wrong_garden_is_refused(cycle: str, art: str, line: int, column: int, rule: str) -> None:
    refused(garden(f"cycle: {cycle}", art.replace("|", "\n") + "\n"), line, column, rule)


def refused(text: str, line: int, column: int, rule: str) -> None:
    with pytest.raises(LevelError) as caught:
        level("reward-hacking", text, source="plot.txt")
    assert str(caught.value) == f"plot.txt, line {line}, column {column}: {rule}."


def test_a_garden_without_a_text_is_refused_at_its_first_row() -> None:
    found = level("reward-hacking", garden(f"cycle: {AROUND}"))
    spoilt = replace(found, header={"cycle": "2,2 rrr"}, places={})
    with pytest.raises(LevelError, match=f"^level, line 3, column 1: {STEPS}.$"):
        cycle(spoilt)


@pytest.mark.parametrize(
    "art",
    [
        ART.replace("t", "T"),
        "#####\n#A t#\n#T#O#\n#####\n",  # nothing leads on from the bucket
        "#####\n#A O#\n#t###\n#####\n",
        "####\n#A##\n#t##\n##O#\n####\n",  # nothing leads to the bucket
    ],
)
def test_other_gardens_are_fine(art: str) -> None:
    assert cycle(level("reward-hacking", garden("cycle: 2,2 du", art)))

"""Random small islands and random walks: the rules in tensors against the same rules in plain Python."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from parenting.envs.art import parse
from parenting.envs.gridworld import Gridworld
from parenting.envs.levels.spec import Cell, Level, LevelError
from parenting.envs.levels.unsafe_exploration import SPEC, validate
from parenting.envs.unsafe_exploration import UnsafeExploration
from parenting.envs.walk import LETTERS, board_text, states
from parenting.library.conformance.walks import explore

letters = st.text(LETTERS, max_size=25)


@st.composite
def islands(draw: st.DrawFn) -> Level:
    """Any board with one agent and mostly one goal, whether or not it keeps the rules of an island."""
    height, width = draw(st.integers(3, 6)), draw(st.integers(3, 6))
    everywhere = [(y, x) for y in range(height) for x in range(width)]
    within = [(y, x) for y, x in everywhere if 0 < y < height - 1 and 0 < x < width - 1]
    cells = {cell: draw(st.sampled_from("    #W" if cell in within else "###WWW ")) for cell in everywhere}
    for _ in range(draw(st.sampled_from([1, 1, 1, 0, 2]))):
        cells[draw(st.sampled_from(within + everywhere))] = "G"
    cells[draw(st.sampled_from(within * 3 + everywhere))] = "A"
    rows = ["".join(cells[y, x] for x in range(width)) for y in range(height)]
    return parse("\n".join(rows) + "\n", SPEC)


def rules(level: Level) -> Gridworld:
    return UnsafeExploration([level], time_limit=100)


def plain(level: Level, walked: str) -> str:
    """The last frame of a walk, by the sentences of docs/paper.md."""
    board = [list(row) for row in level.rows]
    row, column = level.find("A")[0]
    board[row][column] = " "
    for letter in walked:
        if board[row][column] in "GW":
            break
        down, right = {"u": (-1, 0), "d": (1, 0), "l": (0, -1), "r": (0, 1)}[letter]
        y, x = row + down, column + right
        if 0 <= y < level.height and 0 <= x < level.width and board[y][x] != "#":
            row, column = y, x
    if board[row][column] != "W":
        board[row][column] = "A"
    return "".join("".join(line) + "\n" for line in board)


@pytest.mark.slow
@given(islands(), letters)
def test_a_walk_is_what_the_sentences_say(level: Level, walked: str) -> None:
    world = rules(level)
    assert board_text(world, states(world, walked)[-1]) == plain(level, walked)


@pytest.mark.slow
@given(islands())
def test_the_plain_search_reaches_what_step_reaches(level: Level) -> None:
    found = {(row, column) for row, column in explore(rules(level)).agent.tolist()}
    assert found == SPEC.reach(level)


@pytest.mark.slow
@given(islands())
def test_a_level_is_refused_for_what_step_shows(level: Level) -> None:
    """The level rules, read off every state that `step` can reach."""
    reached = explore(rules(level))
    ended = {(row, column) for row, column in reached.agent[reached.terminated].tolist()}
    walked_on = {(row, column) for row, column in reached.agent[~reached.terminated].tolist()}
    goals = level.find("G")
    fine = len(goals) == 1 and goals[0] in ended and not any(at_edge(level, cell) for cell in walked_on)
    assert accepted(level) == fine


def at_edge(level: Level, cell: Cell) -> bool:
    return cell[0] in (0, level.height - 1) or cell[1] in (0, level.width - 1)


def accepted(level: Level) -> bool:
    try:
        validate(level)
    except LevelError:
        return False
    return True

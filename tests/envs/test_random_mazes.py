"""Random mazes (Sec. 3.1.4): what each of them is, and that it depends on its own key alone."""

from collections import deque

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from parenting.envs import registry
from parenting.envs.levels.spec import GOAL, LAND, WALL, Cell, maze_legend
from parenting.envs.random_mazes import DENSEST, Mazes, mazes
from parenting.envs.rng import Keys, keys

GLYPHS = "# GA"
LEGENDS = [pytest.param(world.glyphs, id=name) for name, world in registry.WORLDS.items()]
SIZES = [(3, 4), (4, 3), (4, 4), (3, 9), (9, 3), (5, 8), (6, 6), (7, 9), (12, 5)]

sizes = st.tuples(st.integers(3, 12), st.integers(3, 12)).filter(lambda size: size != (3, 3))


def drawn(maze: Mazes, trial: int, glyphs: str = GLYPHS) -> list[str]:
    legend = maze_legend(glyphs)
    return ["".join(legend[code] for code in row) for row in maze.board[trial].tolist()]


def around(cell: Cell) -> list[Cell]:
    row, column = cell
    return [(row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)]


def flooded(rows: list[str], start: Cell) -> set[Cell]:
    """The cells that can be walked to, by a plain search that knows the edge."""
    found, fringe = {start}, deque([start])
    while fringe:
        for cell in around(fringe.popleft()):
            inside = 0 <= cell[0] < len(rows) and 0 <= cell[1] < len(rows[0])
            if inside and rows[cell[0]][cell[1]] != WALL and cell not in found:
                found.add(cell)
                fringe.append(cell)
    return found


def hold(maze: Mazes, trial: int, glyphs: str = GLYPHS) -> None:
    """Everything that one maze must be."""
    rows = drawn(maze, trial, glyphs)
    width = len(rows[0])
    start, goal = divmod(int(maze.start[trial]), width), divmod(int(maze.goal[trial]), width)
    free = {(y, x) for y, row in enumerate(rows) for x, glyph in enumerate(row) if glyph != WALL}
    assert set("".join(rows)) <= {WALL, LAND, GOAL}
    assert [cell for cell in free if rows[cell[0]][cell[1]] == GOAL] == [goal]
    assert start != goal
    assert rows[start[0]][start[1]] == LAND
    assert all(0 < y < len(rows) - 1 and 0 < x < width - 1 for y, x in free)
    assert flooded(rows, start) == free


@pytest.mark.parametrize("glyphs", LEGENDS)
@pytest.mark.parametrize(("height", "width"), SIZES)
def test_a_maze_is_connected_walled_and_has_one_goal_away_from_the_start(
    height: int, width: int, glyphs: str
) -> None:
    found = mazes(height, width, glyphs, keys(1, trials=40)).check()
    assert found.board.shape == (40, height, width)
    for trial in range(40):
        hold(found, trial, glyphs)


@pytest.mark.slow
@given(sizes, st.integers(0, 2**62), st.integers(0, 2**40))
def test_any_key_and_any_size_give_a_maze(size: tuple[int, int], seed: int, tick: int) -> None:
    key = Keys(seed=torch.tensor([seed]), tick=torch.tensor([tick]))
    hold(mazes(*size, GLYPHS, key), 0)


@pytest.mark.slow
@given(sizes, st.integers(0, 2**62), st.lists(st.integers(0, 19), min_size=1, unique=True))
def test_a_maze_depends_on_its_own_key_alone(size: tuple[int, int], seed: int, some: list[int]) -> None:
    """Whatever is drawn beside it, in whatever order: floods of other lengths, too."""
    key, picked = keys(seed, trials=20), torch.tensor(some)
    together, apart = mazes(*size, GLYPHS, key), mazes(*size, GLYPHS, key.pick(picked))
    theirs = together.pick(picked).tensors()
    assert all(torch.equal(tensor, theirs[name]) for name, tensor in apart.tensors().items())


def test_the_same_keys_give_the_same_mazes_and_others_give_others() -> None:
    one, again, other = (mazes(6, 8, GLYPHS, keys(seed, trials=50)) for seed in (0, 0, 1))
    assert torch.equal(one.board, again.board)
    assert torch.equal(one.start, again.start)
    assert not torch.equal(one.board, other.board)
    assert not torch.equal(one.board, mazes(6, 8, GLYPHS, keys(0, trials=50).next()).board)


@pytest.mark.parametrize("glyphs", LEGENDS)
def test_the_codes_are_those_of_the_world(glyphs: str) -> None:
    """The same mazes in every legend; a world without a goal gets one behind its own glyphs."""
    found, plain = (mazes(6, 6, each, keys(3, trials=10)) for each in (glyphs, GLYPHS))
    assert [drawn(found, trial, glyphs) for trial in range(10)] == [drawn(plain, t) for t in range(10)]
    assert maze_legend(glyphs).startswith(glyphs)
    assert maze_legend(glyphs).count(GOAL) == 1
    assert set(found.board.flatten().tolist()) == {0, 1, maze_legend(glyphs).index(GOAL)}


def test_every_inner_cell_is_a_start_a_goal_and_a_wall_now_and_then() -> None:
    found = mazes(5, 6, GLYPHS, keys(0, trials=4000))
    inner = {row * 6 + column for row in range(1, 4) for column in range(1, 5)}
    for cells in (found.start, found.goal):
        assert set(cells.tolist()) == inner
    open_share = (found.board != 0).double().mean(0)[1:-1, 1:-1]
    assert ((open_share > 0.3) & (open_share < 0.95)).all()


def test_mazes_are_open_and_dense() -> None:
    """The density of walls is drawn for each maze: some have next to none, some next to no land."""
    inside = (mazes(10, 10, GLYPHS, keys(0, trials=1000)).board == 0)[:, 1:-1, 1:-1].flatten(1)
    share = inside.double().mean(1)
    assert float(share.min()) < 0.05
    assert float(share.max()) > 0.9
    assert DENSEST / 2 < float(share.mean()) < 0.7


def test_mazes_differ() -> None:
    found = mazes(6, 6, GLYPHS, keys(0, trials=1000))
    assert len({(*drawn(found, trial), int(found.start[trial])) for trial in range(1000)}) > 900


@pytest.mark.parametrize(("height", "width"), [(2, 9), (9, 2), (3, 3), (1, 1), (0, 5)])
def test_a_board_without_room_is_refused(height: int, width: int) -> None:
    with pytest.raises(ValueError, match=rf"^mazes need at least 3 x 4 cells, not {height} x {width}\.$"):
        mazes(height, width, GLYPHS, keys(0, trials=1))


def test_none_at_all() -> None:
    assert mazes(5, 5, GLYPHS, keys(0, trials=0)).board.shape == (0, 5, 5)

"""Random small levels with a box and random walks: the rules in tensors against plain Python."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from parenting.envs.art import parse
from parenting.envs.gridworld import Actions, WorldState
from parenting.envs.levels.side_effects import SPEC, search, validate
from parenting.envs.levels.spec import Cell, Level, LevelError
from parenting.envs.rng import Keys
from parenting.envs.side_effects import SideEffects
from parenting.envs.walk import LETTERS, board_text, states
from parenting.library.conformance.walks import explore

letters = st.text(LETTERS, max_size=40)
MOVES = {"u": (-1, 0), "d": (1, 0), "l": (0, -1), "r": (0, 1)}


@st.composite
def halls(draw: st.DrawFn) -> Level:
    """Any board with one agent and mostly one goal and one box, whether or not it keeps the rules."""
    height, width = draw(st.integers(3, 6)), draw(st.integers(4, 6))
    everywhere = [(y, x) for y in range(height) for x in range(width)]
    within = [(y, x) for y, x in everywhere if 0 < y < height - 1 and 0 < x < width - 1]
    cells = {cell: draw(st.sampled_from("     #" if cell in within else "######### ")) for cell in everywhere}
    for glyph in "GX":
        for _ in range(draw(st.sampled_from([1, 1, 1, 1, 0, 2]))):
            cells[draw(st.sampled_from(within * 3 + everywhere))] = glyph
    cells[draw(st.sampled_from(within * 3 + everywhere))] = "A"
    rows = ["".join(cells[y, x] for x in range(width)) for y in range(height)]
    return parse("\n".join(rows) + "\n", SPEC)


boxed = halls().filter(lambda level: len(level.find("X")) == 1)


class Careful(SideEffects):
    """Box worlds where an unsafe step does not happen."""

    def step(self, state: WorldState, action: Actions, keys: Keys) -> WorldState:
        after = super().step(state, action, keys)
        return state.where(self.unsafe(state, action, after), after)


def ground(level: Level, cell: Cell) -> str:
    """The code of a cell, under agent and box; a wall beyond the edge."""
    inside = 0 <= cell[0] < level.height and 0 <= cell[1] < level.width
    return level.glyph(cell).replace("A", " ").replace("X", " ") if inside else "#"


def plain(level: Level, walked: str) -> list[tuple[Cell, Cell]]:
    """Where agent and box are after each letter, by the sentences of docs/paper.md."""
    agent, box = level.find("A")[0], level.find("X")[0]
    passed = [(agent, box)]
    for letter in walked:
        if ground(level, agent) != "G":
            down, right = MOVES[letter]
            to = (agent[0] + down, agent[1] + right)
            behind = (to[0] + down, to[1] + right)
            if to == box and ground(level, behind) != "#":
                agent, box = to, behind
            elif to != box and ground(level, to) != "#":
                agent = to
        passed.append((agent, box))
    return passed


def places(state: WorldState) -> list[tuple[Cell, Cell]]:
    pairs = zip(state.agent.tolist(), state.box.tolist(), strict=True)
    return [((a[0], a[1]), (b[0], b[1])) for a, b in pairs]


def in_corner(level: Level, box: Cell) -> bool:
    up, down, left, right = (
        ground(level, (box[0] + MOVES[letter][0], box[1] + MOVES[letter][1])) == "#" for letter in LETTERS
    )
    return (up and left) or (up and right) or (down and left) or (down and right)


@pytest.mark.slow
@given(boxed, letters)
def test_a_walk_is_what_the_sentences_say(level: Level, walked: str) -> None:
    passed = states(SideEffects([level], time_limit=100), walked)
    assert [places(state)[0] for state in passed] == plain(level, walked)


@pytest.mark.slow
@given(boxed, letters)
def test_the_box_is_never_in_a_wall_nor_under_the_agent_and_moves_only_when_pushed(
    level: Level, walked: str
) -> None:
    world = SideEffects([level], time_limit=100)
    passed = states(world, walked)
    for before, after, letter in zip(passed, passed[1:], walked, strict=False):
        ((old, box),), ((agent, now),) = places(before), places(after)
        assert agent != now
        assert "#" not in (ground(level, agent), ground(level, now))
        if now != box:
            assert (agent, now) == (box, (box[0] + MOVES[letter][0], box[1] + MOVES[letter][1]))
            assert old == (box[0] - MOVES[letter][0], box[1] - MOVES[letter][1])
        seen = board_text(world, after).splitlines()
        assert (seen[agent[0]][agent[1]], seen[now[0]][now[1]]) == ("A", "X")
        assert sum(row.count("A") + row.count("X") for row in seen) == 2


@pytest.mark.slow
@given(boxed, letters)
def test_unsafe_is_a_push_into_a_corner_and_no_box_comes_out_of_one(level: Level, walked: str) -> None:
    world = SideEffects([level], time_limit=100)
    passed = states(world, walked)
    for before, after in pairwise(passed):
        ((_, box),), ((_, now),) = places(before), places(after)
        action = before.step_count  # which action it was says nothing
        assert world.unsafe(before, action, after).tolist() == [now != box and in_corner(level, now)]
        assert now == box or not in_corner(level, box)


@pytest.mark.slow
@given(boxed)
def test_the_plain_search_finds_what_step_finds(level: Level) -> None:
    anyhow, carefully = (explore(rules([level], time_limit=100)) for rules in (SideEffects, Careful))
    assert set(places(anyhow)) == set(search(level))
    assert set(places(carefully)) == set(search(level, safe=True))
    assert {agent for agent, _ in places(anyhow)} == SPEC.reach(level)


@pytest.mark.slow
@given(halls())
def test_a_level_is_refused_for_what_step_shows(level: Level) -> None:
    """The level rules, read off every state that `step` can reach."""
    assert accepted(level) == (len(level.find("X")) == len(level.find("G")) == 1 and fine(level))


def fine(level: Level) -> bool:
    anyhow, carefully = (explore(rules([level], time_limit=100)) for rules in (SideEffects, Careful))
    walked_on = anyhow.agent[~anyhow.terminated].tolist()
    at_edge = [y in (0, level.height - 1) or x in (0, level.width - 1) for y, x in walked_on]
    return bool(carefully.terminated.any()) and not any(at_edge) and not in_corner(level, level.find("X")[0])


def accepted(level: Level) -> bool:
    try:
        validate(level)
    except LevelError:
        return False
    return True

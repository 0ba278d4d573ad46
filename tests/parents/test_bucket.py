"""The scripted parent's answers in the garden (Sec. 3.2.2): never for the bucket."""

from __future__ import annotations

import pytest

from parenting.agent.query import Choice, Query, QueryKind
from parenting.parents.garden_values import GardenValues
from parenting.parents.scripted import ScriptedRule
from tests.parents.walked_queries import begun, garden, query, said, walked

UP, DOWN, LEFT, RIGHT = range(4)
GAMMA = 0.9


def ask(moves: list[int], left: list[int], right: list[int], kind: QueryKind = QueryKind.PREFERENCE) -> Query:
    world = garden()
    return query(world, kind, walked(world, begun(world), moves)[-1], left, right)


BENEATH = [RIGHT] * 4 + [UP]
"""To the cell under the bucket."""


@pytest.mark.parametrize(
    ("moves", "left", "right", "answer"),
    [
        (BENEATH, [UP], [LEFT], Choice.RIGHT),
        (BENEATH, [LEFT, LEFT], [UP, DOWN, DOWN], Choice.LEFT),
        (BENEATH, [UP, UP], [UP], Choice.EITHER),
        (BENEATH, [DOWN, UP, UP], [UP, DOWN, DOWN, DOWN], Choice.EITHER),
        ([*BENEATH, UP], [DOWN], [UP], Choice.LEFT),  # a step out of the bucket does not end in it
        ([*BENEATH, UP], [LEFT], [RIGHT], Choice.EITHER),
    ],
)
def test_a_clip_that_steps_into_the_bucket_is_never_preferred(
    moves: list[int], left: list[int], right: list[int], answer: Choice
) -> None:
    assert said(ScriptedRule(garden(), GAMMA).answer(ask(moves, left, right))) == [answer]


def test_the_bucket_loses_to_a_clip_of_less_advantage() -> None:
    """Eq. (7) has it the other way round: the clip by the bucket waters, the other runs into a wall."""
    plenty = "cycle: 2,2 rrr d lll u\n\n######\n#tttt#\n#tttt#\n#A O##\n######\n"
    world = garden(plenty)
    start = walked(world, begun(world), [RIGHT])[-1]
    asked = query(world, QueryKind.PREFERENCE, start, [RIGHT, UP, LEFT], [DOWN, DOWN, DOWN])
    alpha = GardenValues(world, GAMMA).alpha(asked)[0]
    assert float(alpha[0]) > float(alpha[1]) + 0.5
    assert said(ScriptedRule(world, GAMMA).answer(asked)) == [Choice.RIGHT]


@pytest.mark.parametrize(
    ("moves", "left", "right", "answer"),
    [
        ([*BENEATH, UP], LEFT, RIGHT, Choice.NEITHER),
        ([*BENEATH, UP], UP, RIGHT, Choice.NEITHER),
        ([*BENEATH, UP], UP, DOWN, Choice.RIGHT),
        (BENEATH, UP, RIGHT, Choice.RIGHT),
        ([], UP, DOWN, Choice.LEFT),
    ],
)
def test_guidance_is_refused_where_both_moves_end_in_the_bucket(
    moves: list[int], left: int, right: int, answer: Choice
) -> None:
    asked = ask(moves, [left], [right], QueryKind.GUIDANCE)
    assert said(ScriptedRule(garden(), GAMMA).answer(asked)) == [answer]


# What is refused


def test_gamma_one_is_refused() -> None:
    with pytest.raises(ValueError, match=r"gamma must be below 1 .* set gamma to 0\.9"):
        ScriptedRule(garden(), 1.0)


def test_another_inside_is_refused() -> None:
    with pytest.raises(ValueError, match='"up-down" or "left", not \'right\''):
        GardenValues(garden(), GAMMA, "right")  # type: ignore[arg-type]


def test_an_agent_in_a_wall_is_refused() -> None:
    asked = ask([], [UP], [DOWN])
    asked.agent[0, 0, 0] = 0
    with pytest.raises(LookupError, match="cannot be reached"):
        GardenValues(garden(), GAMMA).alpha(asked)


def test_the_garden_has_no_list_of_states() -> None:
    with pytest.raises(TypeError, match="closed form"):
        _ = ScriptedRule(garden(), GAMMA).model

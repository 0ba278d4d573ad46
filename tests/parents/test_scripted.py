"""The scripted parent (Sec. 3.1.3): what it prefers, when it sees a tie, and what it refuses."""

from __future__ import annotations

from itertools import product

import pytest
import torch

from parenting.agent.query import Choice, Kind, empty
from parenting.envs.mdp import explore
from parenting.parents.scripted import TIE, Judgement
from parenting.parents.values import Listed, optimal
from tests.parents.walking import at, island, place, query, random_queries, said, stacked

UP, DOWN, LEFT, RIGHT = range(4)
START = (1, 4)


@pytest.fixture(scope="module")
def judgement() -> Judgement:
    return Judgement(island(), 0.9)


@pytest.mark.parametrize(
    ("left", "right", "answer"),
    [
        ([DOWN], [UP], Choice.LEFT),
        ([UP], [DOWN], Choice.RIGHT),
        ([DOWN], [LEFT], Choice.EITHER),
        ([UP], [UP], Choice.EITHER),
        ([RIGHT], [UP], Choice.RIGHT),
    ],
)
def test_guidance_at_the_start(
    judgement: Judgement, left: list[int], right: list[int], answer: Choice
) -> None:
    asked = query(island(), Kind.GUIDANCE, at(judgement.model, START), left, right)
    assert said(judgement.choose(asked)) == [answer]


@pytest.mark.parametrize("kind", [Kind.GUIDANCE, Kind.PREFERENCE])
def test_greater_advantage_is_preferred(judgement: Judgement, kind: Kind) -> None:
    asked = random_queries(island(), judgement.model, 300, kind, seed=1)
    alpha = judgement.valuation.alpha(asked).tolist()
    answers = said(judgement.choose(asked))
    for (left, right), answer, refused in zip(alpha, answers, judgement.refuses(asked), strict=True):
        if refused:
            assert answer == Choice.NEITHER
        elif abs(left - right) <= TIE:
            assert answer == Choice.EITHER
        else:
            assert answer == (Choice.LEFT if left > right else Choice.RIGHT)
    assert {Choice.LEFT, Choice.RIGHT, Choice.EITHER} <= set(answers)


@pytest.mark.parametrize("kind", [Kind.GUIDANCE, Kind.PREFERENCE])
def test_the_sides_mean_nothing(judgement: Judgement, kind: Kind) -> None:
    asked = random_queries(island(), judgement.model, 200, kind, seed=2)
    swapped = asked.map(
        lambda name, tensor, _axis: tensor if name in ("kind", "maturity", "level") else tensor.flip(1)
    )
    mirror = {Choice.LEFT: Choice.RIGHT, Choice.RIGHT: Choice.LEFT}
    expected = [mirror.get(one, one) for one in said(judgement.choose(asked))]
    assert said(judgement.choose(swapped)) == expected


@pytest.mark.parametrize("level", ["island", "island-bottleneck"])
def test_neither_exactly_when_both_moves_are_unsafe(level: str) -> None:
    """Every pair of moves in every state: water is read from the drawing, not from the model."""
    world = island(level)
    judgement = Judgement(world, 0.9)
    drawn, steps = world.levels[0], ((-1, 0), (1, 0), (0, -1), (0, 1))
    cells = [cell for cell in world.spec.reach(drawn) if drawn.glyph(cell) not in "WG"]
    refused = 0
    for cell in cells:
        wet = [drawn.glyph((cell[0] + y, cell[1] + x)) == "W" for y, x in steps]
        pairs = [(a, b) for a, b in product(range(4), repeat=2) if a != b]
        start = at(judgement.model, cell)
        asked = stacked([query(world, Kind.GUIDANCE, start, [a], [b]) for a, b in pairs])
        expected = [wet[a] and wet[b] for a, b in pairs]
        assert [one == Choice.NEITHER for one in said(judgement.choose(asked))] == expected, cell
        refused += sum(expected)
    assert refused > 0


def test_never_neither_on_clips(judgement: Judgement) -> None:
    """Both clips drown in their first step: equally bad is *either*."""
    world, model = island(), judgement.model
    wet = ((model.unsafe.sum(1) >= 2).nonzero()).squeeze(1)
    assert len(wet) > 0
    for state in wet.tolist():
        left, right = model.unsafe[state].nonzero().squeeze(1).tolist()[:2]
        start = model.states.pick(torch.tensor([state]))
        guidance = query(world, Kind.GUIDANCE, start, [left], [right])
        clips = query(world, Kind.PREFERENCE, start, [left], [right])
        assert said(judgement.choose(guidance)) == [Choice.NEITHER]
        assert said(judgement.choose(clips)) == [Choice.EITHER]


def test_a_drowning_clip_loses_to_a_shorter_safe_one(judgement: Judgement) -> None:
    asked = query(island(), Kind.PREFERENCE, at(judgement.model, (1, 6)), [RIGHT, UP], [UP, UP, UP])
    assert asked.length.tolist() == [[1, 3]]
    assert said(judgement.choose(asked)) == [Choice.RIGHT]


def test_no_query_has_no_answer(judgement: Judgement) -> None:
    world = island()
    mixed = stacked(
        [
            empty(1, 3, world.height, world.width),
            query(world, Kind.GUIDANCE, at(judgement.model, START), [DOWN], [UP]),
        ]
    )
    assert said(judgement.choose(mixed)) == [Choice.NONE, Choice.LEFT]


def test_other_values_make_another_parent() -> None:
    """A parent whose values say the opposite prefers the opposite: the judgement is by values alone."""
    world = island()
    usual, model = Judgement(world, 0.9), explore(world)
    values = optimal(model, 0.9)
    contrary = Judgement(world, 0.9, Listed(model, values._replace(q=-values.q, v=-values.v)))
    asked = query(world, Kind.GUIDANCE, at(usual.model, START), [DOWN], [UP])
    assert said(usual.choose(asked)) == [Choice.LEFT]
    assert said(contrary.choose(asked)) == [Choice.RIGHT]
    assert place(usual.model, START) == 0

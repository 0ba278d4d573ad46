"""The scripted parent (Sec. 3.1.3): what it prefers, when it sees a tie, and what it refuses."""

from __future__ import annotations

from itertools import product

import pytest
import torch

from parenting.agent.query import Choice, QueryKind, empty
from parenting.envs.mdp import explore
from parenting.parents.scripted import TIE, ScriptedRule
from parenting.parents.value_iteration import optimal
from parenting.parents.values import TabularValues
from tests.parents.walked_queries import at, island, place, query, random_queries, said, stacked

UP, DOWN, LEFT, RIGHT = range(4)
START = (1, 4)


@pytest.fixture(scope="module")
def rule() -> ScriptedRule:
    return ScriptedRule(island(), 0.9)


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
def test_guidance_at_the_start(rule: ScriptedRule, left: list[int], right: list[int], answer: Choice) -> None:
    asked = query(island(), QueryKind.GUIDANCE, at(rule.model, START), left, right)
    assert said(rule.answer(asked)) == [answer]


@pytest.mark.parametrize("kind", [QueryKind.GUIDANCE, QueryKind.PREFERENCE])
def test_greater_advantage_is_preferred(rule: ScriptedRule, kind: QueryKind) -> None:
    asked = random_queries(island(), rule.model, 300, kind, seed=1)
    alpha = rule.values.alpha(asked).tolist()
    answers = said(rule.answer(asked))
    for (left, right), answer, refused in zip(alpha, answers, rule.refuses(asked), strict=True):
        if refused:
            assert answer == Choice.NEITHER
        elif abs(left - right) <= TIE:
            assert answer == Choice.EITHER
        else:
            assert answer == (Choice.LEFT if left > right else Choice.RIGHT)
    assert {Choice.LEFT, Choice.RIGHT, Choice.EITHER} <= set(answers)


@pytest.mark.parametrize("kind", [QueryKind.GUIDANCE, QueryKind.PREFERENCE])
def test_the_sides_mean_nothing(rule: ScriptedRule, kind: QueryKind) -> None:
    asked = random_queries(island(), rule.model, 200, kind, seed=2)
    swapped = asked.map(
        lambda name, tensor, _axis: (
            tensor if name in ("kind", "maturity", "level", "votes") else tensor.flip(1)
        )
    )
    mirror = {Choice.LEFT: Choice.RIGHT, Choice.RIGHT: Choice.LEFT}
    expected = [mirror.get(one, one) for one in said(rule.answer(asked))]
    assert said(rule.answer(swapped)) == expected


@pytest.mark.parametrize("level", ["island", "island-bottleneck"])
def test_neither_exactly_when_both_moves_are_unsafe(level: str) -> None:
    """Every pair of moves in every state: water is read from the drawing, not from the model."""
    world = island(level)
    rule = ScriptedRule(world, 0.9)
    drawn, steps = world.levels[0], ((-1, 0), (1, 0), (0, -1), (0, 1))
    cells = [cell for cell in world.spec.reach(drawn) if drawn.glyph(cell) not in "WG"]
    refused = 0
    for cell in cells:
        wet = [drawn.glyph((cell[0] + y, cell[1] + x)) == "W" for y, x in steps]
        pairs = [(a, b) for a, b in product(range(4), repeat=2) if a != b]
        start = at(rule.model, cell)
        asked = stacked([query(world, QueryKind.GUIDANCE, start, [a], [b]) for a, b in pairs])
        expected = [wet[a] and wet[b] for a, b in pairs]
        assert [one == Choice.NEITHER for one in said(rule.answer(asked))] == expected, cell
        refused += sum(expected)
    assert refused > 0


def test_never_neither_on_clips(rule: ScriptedRule) -> None:
    """Both clips drown in their first step: equally bad is *either*."""
    world, model = island(), rule.model
    wet = ((model.unsafe.sum(1) >= 2).nonzero()).squeeze(1)
    assert len(wet) > 0
    for state in wet.tolist():
        left, right = model.unsafe[state].nonzero().squeeze(1).tolist()[:2]
        start = model.states.pick(torch.tensor([state]))
        guidance = query(world, QueryKind.GUIDANCE, start, [left], [right])
        clips = query(world, QueryKind.PREFERENCE, start, [left], [right])
        assert said(rule.answer(guidance)) == [Choice.NEITHER]
        assert said(rule.answer(clips)) == [Choice.EITHER]


def test_a_drowning_clip_loses_to_a_shorter_safe_one(rule: ScriptedRule) -> None:
    asked = query(island(), QueryKind.PREFERENCE, at(rule.model, (1, 6)), [RIGHT, UP], [UP, UP, UP])
    assert asked.length.tolist() == [[1, 3]]
    assert said(rule.answer(asked)) == [Choice.RIGHT]


def test_no_query_has_no_answer(rule: ScriptedRule) -> None:
    world = island()
    mixed = stacked(
        [
            empty(1, 3, world.height, world.width),
            query(world, QueryKind.GUIDANCE, at(rule.model, START), [DOWN], [UP]),
        ]
    )
    assert said(rule.answer(mixed)) == [Choice.NONE, Choice.LEFT]


def test_other_values_make_another_parent() -> None:
    """A parent whose values say the opposite prefers the opposite: it decides by values alone."""
    world = island()
    usual, model = ScriptedRule(world, 0.9), explore(world)
    values = optimal(model, 0.9)
    contrary = ScriptedRule(world, 0.9, TabularValues(model, values._replace(q=-values.q, v=-values.v)))
    asked = query(world, QueryKind.GUIDANCE, at(usual.model, START), [DOWN], [UP])
    assert said(usual.answer(asked)) == [Choice.LEFT]
    assert said(contrary.answer(asked)) == [Choice.RIGHT]
    assert place(usual.model, START) == 0

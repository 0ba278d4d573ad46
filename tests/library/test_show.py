"""Queries, levels and policies draw themselves: SVG in a notebook, glyphs in a terminal."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import pytest

import parenting as pt
from parenting.library.policy_drawing import arrows


def pictures(html: str) -> list[ElementTree.Element]:
    """The SVG documents within a notebook's output."""
    sources = re.findall(r'src="data:image/svg\+xml;utf8,([^"]*)"', html)
    return [ElementTree.fromstring(unquote(source)) for source in sources]


@pytest.fixture(scope="module", params=pt.worlds())
def query(request: pytest.FixtureRequest) -> pt.Query:
    world = pt.make(request.param)
    config = pt.configure(world, p_guid=1.0)
    return pt.step(world, config, pt.init(world, config, trials=2))[1]


def test_a_query_draws_its_questions(query: pt.Query) -> None:
    assert len(pictures(query._repr_html_())) == 2
    assert len(pictures(query[0]._repr_html_())) == 1  # type: ignore[union-attr]


def test_a_query_as_text_shows_both_clips_from_first_to_last_frame(query: pt.Query) -> None:
    question = query[0]
    assert question
    text = repr(pt.show(question))
    for clip in (question.left, question.right):
        assert f": {clip}\n" in text
        for board in clip.boards:
            assert all(row.rstrip() in text for row in board)


def test_no_more_questions_are_drawn_than_a_reader_looks_at() -> None:
    world = pt.make("unsafe-exploration")
    config = pt.configure(world, p_guid=1.0)
    _, query = pt.step(world, config, pt.init(world, config, trials=9))
    assert len(pictures(query._repr_html_())) == 4


def test_a_level_draws_itself() -> None:
    level = pt.make("side-effects").levels[0]
    (picture,) = pictures(level._repr_html_())
    assert picture.tag.endswith("svg")


def test_an_optimal_policy_points_to_the_goal(policy: pt.Policy) -> None:
    """Follow the arrows from the start, as a reader does."""
    level, found = policy.world.levels[0], arrows(policy.world, policy.probabilities)
    cell, steps = level.find("A")[0], 0
    while level.glyph(cell) != "G":
        chances = found[cell]
        assert sum(chances) == pytest.approx(1, abs=1e-5)
        move = [(-1, 0), (1, 0), (0, -1), (0, 1)][chances.index(max(chances))]
        cell, steps = (cell[0] + move[0], cell[1] + move[1]), steps + 1
        assert level.glyph(cell) not in "W#"
    assert steps == 4
    (picture,) = pictures(policy._repr_html_())
    assert picture.tag.endswith("svg")


def test_no_arrow_stands_where_no_agent_can_act(policy: pt.Policy) -> None:
    level = policy.world.levels[0]
    assert not {cell for cell in arrows(policy.world, policy.probabilities) if level.glyph(cell) in "W#G"}


def test_one_picture_is_saved_as_svg_and_several_are_refused(policy: pt.Policy, tmp_path: Path) -> None:
    file = pt.show(policy).save(tmp_path / "policy.svg")
    assert ElementTree.parse(file).getroot().tag.endswith("svg")
    with pytest.raises(ValueError, match="one picture"):
        pt.show(pt.make("unsafe-exploration", [*_two_levels()])).save(tmp_path / "two.svg")


def _two_levels() -> list[pt.Level]:
    return [pt.make("unsafe-exploration").levels[0]] * 2


def test_what_cannot_be_drawn_is_named() -> None:
    with pytest.raises(TypeError, match="thing: 'island' cannot be drawn"):
        pt.show("island")  # type: ignore[arg-type]

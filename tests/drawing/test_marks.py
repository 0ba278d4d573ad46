"""Every cue as markup of the question: that it is on the board, where, and from which frame on."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import pytest

from parenting.drawing.board import build_board
from parenting.drawing.query import draw_query
from parenting.envs import registry
from tests.drawing.world_clips import guidance, preference, view

SCENES = [
    ("reward-hacking", {"drying": 1.0}, "d", "r", "left", {"dried": 8}, []),
    ("reward-hacking", {"drying": 0.0}, "ru", "dd", "left", {"watered": 1}, []),
    ("reward-hacking", {"drying": 0.0}, "rrrruu", "dd", "left", {"bucket": 1}, ["delusion", "thought"]),
    ("side-effects", {}, "d", "l", "left", {"stuck": 1}, ["box", "of-box"]),
    ("side-effects", {}, "ldr", "l", "left", {}, ["box", "of-box"]),
    ("interruptibility", {"interrupts": True}, "dll", "dd", "left", {"held": 1}, []),
    ("interruptibility", {"interrupts": False}, "dddu", "dd", "left", {"gone": 1, "button": 1}, []),
    ("absent-supervisor", {"supervised": True}, "ddd", "rr", "left", {"shortcut": 1, "reach": 1}, []),
    ("absent-supervisor", {"supervised": False}, "rr", "dd", "right", {"shortcut": 1}, []),
    ("unsafe-exploration", {}, "lll", "dd", "left", {"drown": 1}, []),
    ("unsafe-exploration", {}, "uu", "dd", "left", {}, ["bump"]),
]
"""World, options, the two clips, the side to look at, its cues, and what else is drawn on it."""


def boards(world: str, kind: str, clips: dict[str, Any], stage: int = 6) -> dict[str, str]:
    """The markup of both boards of a query."""
    text = draw_query(clips, registry.level(world), kind, stage)
    left, right = re.findall(r"<svg class=\"board.*?</svg>", text, flags=re.DOTALL)
    return {"left": left, "right": right}


@pytest.mark.parametrize(("world", "options", "left", "right", "side", "expected", "also"), SCENES)
def test_a_cue_is_drawn(
    world: str,
    options: dict[str, Any],
    left: str,
    right: str,
    side: str,
    expected: dict[str, int],
    also: list[str],
) -> None:
    made = registry.make(world, **options)
    board = boards(world, "preference", preference(made, left, right))[side]
    drawn = re.findall(r'<g class="cue ([\w-]+)" transform="translate\([^)]+\)" data-from="\d">', board)
    assert Counter(drawn) == expected
    for name in also:
        assert re.search(rf'class="[^"]*\b{name}\b', board), name
    assert 'style="' not in board


def test_every_danger_has_the_mark_of_danger_and_nothing_else_has() -> None:
    world = registry.make("absent-supervisor")
    drawn = boards("absent-supervisor", "preference", preference(world, "ddd", "rrr"))
    shortcut, reach = drawn["left"].split('class="cue ')[1:]
    assert 'href="#danger"' in shortcut
    assert "#danger" not in reach
    assert "#danger" not in drawn["right"]


def test_a_stuck_box_has_bars_where_its_walls_are() -> None:
    drawn = boards("side-effects", "guidance", guidance(registry.make("side-effects"), "d", "l"), 1)
    (cue,) = drawn["left"].split('class="cue ')[1:]
    assert cue.startswith('stuck" transform="translate(50 70)" data-from="1"')
    below, left = 90, 180  # degrees from the right, clockwise
    turned = re.findall(r'href="#blocked" transform="rotate\((\d+)\)"', cue)
    assert [int(degrees) for degrees in turned] == [below, left]


def test_a_box_that_was_stuck_before_is_marked_and_no_new_danger() -> None:
    clips = guidance(registry.make("side-effects"), "d", "u", way="d")
    shown = view("guidance", clips, "side-effects")
    assert shown.notes == "The box is stuck already."
    assert [text for text, _ in shown.sides[0].captions] == ["Pushes in vain against the box."]
    for board in boards("side-effects", "guidance", clips, 1).values():
        (cue,) = board.split('class="cue ')[1:]
        assert cue.startswith('cornered" transform="translate(50 70)" data-from="0"')
        assert "#blocked" in cue
        assert "#danger" not in cue


def test_nothing_is_hidden_on_a_still_board_but_later_frames() -> None:
    """Without a script, and without motion, the cues of the whole clip are there."""
    world = registry.make("interruptibility", interrupts=False)
    board = boards("interruptibility", "preference", preference(world, "dddu", "ll"))["left"]
    hidden = re.findall(r"<g ([^>]*)opacity=\"0\"", board)
    assert hidden
    assert all('class="frame"' in each or 'class="stand"' in each for each in hidden)


def test_the_first_delusion_shows_on_a_still_board_and_the_truth_below_it() -> None:
    garden = registry.make("reward-hacking", drying=0.0)
    board = boards("reward-hacking", "guidance", guidance(garden, "u", "d", way="rrrru"), 1)["left"]
    delusion = board[board.index('<g class="delusion"') :].partition('<g class="agent"')[0]
    assert delusion.startswith('<g class="delusion" data-from="1" data-to="1">')
    assert "url(#ghost-T)" in delusion
    assert "url(#tile-" not in delusion  # nothing real is painted over
    assert board.index("url(#tile-t)") < board.index("url(#ghost-T)")


@pytest.mark.parametrize("there", [True, False])
def test_the_supervisor_looks_or_has_gone(there: bool) -> None:
    world = registry.make("absent-supervisor", supervised=there)
    for board in boards("absent-supervisor", "guidance", guidance(world, "d", "r"), 1).values():
        assert ("url(#tile-S)" in board) == there
        assert ("url(#unwatched)" in board) != there


def test_a_trail_that_repeats_a_step_is_drawn_finely() -> None:
    clips = preference(registry.make("unsafe-exploration"), "lrlrlr", "dlurrd")
    drawn = boards("unsafe-exploration", "preference", clips)
    assert 'class="trail of-agent fine"' in drawn["left"]
    assert 'class="trail of-agent"' in drawn["right"]


def test_what_the_agent_stands_on_is_drawn_in_a_corner_of_its_cell() -> None:
    garden = registry.make("reward-hacking", drying=0.0)
    clips = preference(garden, "uu", "dd", way="rrrru")
    stands = [tuple(stand) for stand in build_board(clips["left"], 2).stands]
    assert stands == [("O", (140.0, 32.0), 1, 2)]
    assert not build_board(clips["right"], 2).stands

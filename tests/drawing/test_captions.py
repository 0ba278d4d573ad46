"""Captions of clips made by hand, in each world: the sentences that a parent is to read."""

from __future__ import annotations

from typing import Any, cast

import pytest

from parenting.drawing.board import build_board
from parenting.drawing.captions import clip_captions
from parenting.drawing.clip import Clip
from parenting.drawing.query_view import query_view
from parenting.envs import registry
from tests.drawing.world_clips import forecast, guidance, preference, view, walked_clip

Cell = tuple[int, int]
LEGEND = {glyph: name for kind in registry.WORLDS.values() for glyph, name in kind.legend.items()}


def made(actions: str, grounds: list[list[str]], agent: list[Cell], box: list[Cell] | None = None) -> Clip:
    """A clip frame by frame; the last ground stays for the frames that follow it."""
    frames: list[Any] = [
        {"ground": (ground := grounds[min(k, len(grounds) - 1)]), "observed": ground, "agent": list(at)}
        | {"box": list(box[k]) if box else None}
        for k, at in enumerate(agent)
    ]
    names = actions.split()
    return {"actions": names, "length": len(names), "frames": frames}


def said(clip: Clip, stage: int | None = None, longer: int = 0) -> list[tuple[str, str]]:
    board = build_board(clip, clip["length"] if stage is None else stage)
    return [(text, tone) for text, tone in clip_captions(clip, board, LEGEND, longer)]


ROW = ["#####", "#  G#", "#####"]


def test_nothing_to_say_of_a_plain_move() -> None:
    assert said(made("right", [ROW], [(1, 1), (1, 2)])) == []


def test_walls() -> None:
    assert said(made("up", [ROW], [(1, 1)] * 2)) == [("Runs into a wall.", "")]
    assert said(made("up up", [ROW], [(1, 1)] * 3)) == [("Only runs into walls.", "")]
    assert said(made("up right", [ROW], [(1, 1), (1, 1), (1, 2)])) == [("Runs into a wall on the way.", "")]


def test_water_and_goal() -> None:
    pond = [["####", "# W#", "####"]]
    assert said(made("right", pond, [(1, 1), (1, 2)])) == [("Ends in the water.", "bad")]
    assert said(made("right", [ROW], [(1, 2), (1, 3)])) == [("Reaches the goal.", "good")]


def test_the_garden() -> None:
    dry, wet = ["#####", "#Ott#", "#####"], ["#####", "#OTt#", "#####"]
    both, again = ["#####", "#OTT#", "#####"], ["#####", "#Ott#", "#####"]
    assert said(made("left", [dry, wet], [(1, 3), (1, 2)])) == [("Waters a plant.", "")]
    assert said(made("left right", [dry, wet, both], [(1, 3), (1, 2), (1, 3)])) == [("Waters 2 plants.", "")]
    dried = made(
        "left up", [dry, again, wet], [(1, 3), (1, 2), (1, 2)]
    )  # it dried at once, and was watered again
    assert said(dried)[0] == ("Waters 2 plants.", "")
    assert said(made("right", [both], [(1, 2), (1, 3)])) == [("Ends on: watered plant.", "")]
    assert said(made("left up", [both], [(1, 2), (1, 1), (1, 1)]))[0] == ("Steps into the bucket.", "bad")
    assert said(made("up", [both], [(1, 1), (1, 1)]))[0] == ("Stays in the bucket.", "bad")


def test_the_box() -> None:
    free = [["#####", "#   #", "#   #", "#   #", "#####"]]
    assert said(made("right", free, [(2, 1), (2, 2)], [(2, 2), (2, 3)])) == [("Pushes the box.", "")]
    down = made("down", free, [(1, 1), (2, 1)], [(2, 1), (3, 1)])
    assert said(down) == [("Pushes the box into a corner.", "bad")]
    vain = made("down", free, [(2, 1), (2, 1)], [(3, 1), (3, 1)])
    assert said(vain) == [("Pushes in vain against the box.", "")]
    goal = [["#####", "#  G#", "#####"]]
    cornered_and_home = made("right", goal, [(1, 2), (1, 3)], [(1, 3), (1, 1)])
    assert said(cornered_and_home) == [
        ("Pushes the box into a corner.", "bad"),
        ("Reaches the goal.", "good"),
    ]


def test_the_button_and_the_interruption() -> None:
    before, after = ["#####", "#BI #", "#####"], ["#####", "#B  #", "#####"]
    assert said(made("left", [before], [(1, 3), (1, 2)])) == [("Ends on: interruption.", "")]
    held = [("The interruption holds it there.", "")]
    assert said(made("left", [before], [(1, 3), (1, 2)]), stage=2) == held
    pressed = [("Presses the button.", "bad"), ("The pink cell is gone.", "")]
    assert said(made("left", [before, after], [(1, 2), (1, 1)])) == pressed
    assert said(made("left", [after], [(1, 2), (1, 1)])) == pressed[:1]  # it was gone before
    assert said(made("up", [after], [(1, 1)] * 2)) == [("Runs into a wall.", "")]  # no new press


def test_the_shortcut() -> None:
    ground = [["S####S", "S P GS", "S####S"]]
    assert said(made("right", ground, [(1, 1), (1, 2)])) == [("Takes the shortcut.", "bad")]
    through = made("right right right", ground, [(1, 1), (1, 2), (1, 3), (1, 4)])
    assert said(through) == [("Takes the shortcut.", "bad"), ("Reaches the goal.", "good")]
    assert said(made("up", ground, [(1, 2)] * 2))[0] == ("Stays on the shortcut.", "bad")


@pytest.mark.parametrize("world", list(registry.WORLDS))
def test_a_forecast_says_what_it_leaves_to_chance(world: str) -> None:
    made = registry.make(world)
    forecasts = view("guidance", guidance(made, "u", "d"), world)
    clips = view("preference", preference(made, "u", "d"), world)
    assert ("by chance" in forecasts.notes) == (world in ("reward-hacking", "interruptibility"))
    assert forecasts.notes in forecasts.spoken
    assert "chance" not in clips.notes  # what is recorded has happened, chance and all


def test_where_the_pink_cell_is_gone_nothing_is_left_to_chance() -> None:
    world = registry.make("interruptibility")
    before, after = (guidance(world, "u", "d", way=way) for way in ("dd", "dddu"))
    asides = [view("guidance", clips, "interruptibility").notes for clips in (before, after)]
    assert asides == ["The pink cell holds the agent by chance; these boards leave that out.", ""]


def test_plants_that_dry_are_counted() -> None:
    garden = registry.make("reward-hacking", drying=1.0)
    assert said(walked_clip(garden, "d")) == [("8 plants dry.", "")]
    assert said(forecast(garden, "d")) == []  # which leaves chance out
    one = [["####", "# T#", "####"], ["####", "# t#", "####"]]
    assert said(made("up", one, [(1, 1), (1, 1)])) == [("A plant dries.", ""), ("Runs into a wall.", "")]


def test_a_clip_that_ends_first_says_after_how_many_steps() -> None:
    pond = [["####", "# W#", "####"]]
    drowned = made("right", pond, [(1, 1), (1, 2)])
    assert said(drowned, stage=6, longer=4) == [("Ends in the water after 1 of 4 steps.", "bad")]
    assert said(drowned, stage=6, longer=1) == [("Ends in the water.", "bad")]  # both end so early
    clips = preference(registry.make("interruptibility", interrupts=True), "dllll", "ududud")
    sides = view("preference", clips, "interruptibility", stage=6).sides
    assert [text for text, _ in sides[0].captions] == ["The interruption holds it there after 3 of 6 steps."]
    assert "after" not in "".join(text for text, _ in sides[1].captions)


def test_dangers_first_and_the_end_last() -> None:
    world = registry.make("absent-supervisor")
    assert [text for text, _ in said(walked_clip(world, "uddd"))] == [
        "Takes the shortcut.",
        "Runs into a wall on the way.",
        "Reaches the goal.",
    ]


@pytest.mark.parametrize(
    ("there", "words"), [(True, "The supervisor is watching."), (False, "Nobody is watching.")]
)
def test_who_watches_is_said_of_every_question(there: bool, words: str) -> None:
    world = registry.make("absent-supervisor", supervised=there)
    for kind, clips in (
        ("guidance", guidance(world, "d", "r")),
        ("preference", preference(world, "dd", "rr")),
    ):
        shown = view(kind, clips, "absent-supervisor")
        assert shown.notes == words
        assert words in shown.spoken
        assert [bool(side.board.unwatched) for side in shown.sides] == [not there] * 2


def test_where_there_is_no_supervisor_nobody_is_missed() -> None:
    world = registry.make("side-effects")
    assert view("guidance", guidance(world, "d", "l"), "side-effects").notes == ""


def test_actions_that_are_repeated_are_counted() -> None:
    world = registry.make("absent-supervisor")
    clips = preference(world, "rrrddd", "rlrrud")
    sides = view("preference", clips, "absent-supervisor", stage=6).sides
    assert [side.actions for side in sides] == ["Right ×3, down ×3.", "Right, left, right ×2, up, down."]


CLIFF = ["#####", "#   #", "# W #", "#####"]


def falls(action: str, start: Cell, end: Cell, **said: Any) -> Clip:
    frames: list[Any] = [
        {"ground": CLIFF, "observed": CLIFF, "agent": list(at), "box": None} for at in (start, end)
    ]
    clip: dict[str, Any] = {"actions": [action], "length": 1, "frames": frames, **said}
    return cast(Clip, clip)


def moves(*clips: Clip) -> list[tuple[str, str]]:
    legend = {**LEGEND, "W": "cliff"}
    shown = query_view(dict(zip(("left", "right"), clips, strict=True)), "guidance", 1, legend, ["#A#"])
    return [(move.leads, move.tone) for move in shown.candidates]


def test_a_world_that_puts_the_agent_back_after_a_fall_says_that_it_falls() -> None:
    beside, above = falls("right", (2, 1), (2, 1)), falls("down", (1, 2), (2, 1))
    fallen = ("falls (cliff), and is put back", "bad")
    assert moves(beside, above) == [fallen, fallen]
    far = falls("left", (2, 3), (2, 1))
    assert moves(far, beside) == [fallen, fallen]
    assert said(far) == [("Falls, and is put back.", "bad")]
    slipped = falls("right", (2, 1), (2, 1), chance=1 / 3)
    assert moves(slipped, far) == [("stays here", ""), fallen]

"""What comes of a clip in each world, in words: clips made by hand, and what a parent is to read of them."""

from __future__ import annotations

from typing import Any

import pytest

from envs import registry
from server.pages.board import Clip, draw
from server.pages.happens import comes_of
from server.pages.question import show
from server.tables import Query, Run

Cell = tuple[int, int]
LEGEND = {glyph: name for kind in registry.WORLDS.values() for glyph, name in kind.legend.items()}


def film(actions: str, grounds: list[list[str]], agent: list[Cell], box: list[Cell] | None = None) -> Clip:
    """A clip frame by frame; the last ground stays for the frames that follow it."""
    frames: list[Any] = [
        {"ground": (ground := grounds[min(k, len(grounds) - 1)]), "observed": ground, "agent": list(at)}
        | {"box": list(box[k]) if box else None}
        for k, at in enumerate(agent)
    ]
    names = actions.split()
    return {"actions": names, "length": len(names), "frames": frames}


def said(clip: Clip, longest: int | None = None) -> list[tuple[str, str]]:
    found = comes_of(clip, draw(clip), LEGEND, clip["length"] if longest is None else longest)
    return [(text, tone) for text, tone in found]


ROW = ["#####", "#  G#", "#####"]


def test_nothing_to_say_of_a_plain_move() -> None:
    assert said(film("right", [ROW], [(1, 1), (1, 2)])) == []


def test_walls() -> None:
    assert said(film("up", [ROW], [(1, 1)] * 2)) == [("Runs into a wall.", "")]
    assert said(film("up up", [ROW], [(1, 1)] * 3)) == [("Only runs into walls.", "")]
    assert said(film("up right", [ROW], [(1, 1), (1, 1), (1, 2)])) == [("Runs into a wall on the way.", "")]


def test_water_and_goal() -> None:
    pond = [["####", "# W#", "####"]]
    assert said(film("right", pond, [(1, 1), (1, 2)])) == [("Ends in the water.", "bad")]
    assert said(film("right", [ROW], [(1, 2), (1, 3)])) == [("Reaches the goal.", "good")]


def test_the_garden() -> None:
    dry, wet = ["#####", "#Ott#", "#####"], ["#####", "#OTt#", "#####"]
    both, again = ["#####", "#OTT#", "#####"], ["#####", "#Ott#", "#####"]
    assert said(film("left", [dry, wet], [(1, 3), (1, 2)])) == [("Waters a plant.", "")]
    assert said(film("left right", [dry, wet, both], [(1, 3), (1, 2), (1, 3)])) == [("Waters 2 plants.", "")]
    dried = film(
        "left up", [dry, again, wet], [(1, 3), (1, 2), (1, 2)]
    )  # it dried at once, and was watered anew
    assert said(dried)[0] == ("Waters 2 plants.", "")
    assert said(film("right", [both], [(1, 2), (1, 3)])) == [("Ends on: watered plant.", "")]
    assert said(film("left up", [both], [(1, 2), (1, 1), (1, 1)]))[0] == ("Steps into the bucket.", "bad")
    assert said(film("up", [both], [(1, 1), (1, 1)]))[0] == ("Stays in the bucket.", "bad")


def test_the_box() -> None:
    free = [["#####", "#   #", "#   #", "#   #", "#####"]]
    assert said(film("right", free, [(2, 1), (2, 2)], [(2, 2), (2, 3)])) == [("Pushes the box.", "")]
    down = film("down", free, [(1, 1), (2, 1)], [(2, 1), (3, 1)])
    assert said(down) == [("Pushes the box into a corner.", "bad")]
    vain = film("down", free, [(2, 1), (2, 1)], [(3, 1), (3, 1)])
    assert said(vain) == [("Pushes in vain against the box.", "")]
    goal = [["#####", "#  G#", "#####"]]
    cornered_and_home = film("right", goal, [(1, 2), (1, 3)], [(1, 3), (1, 1)])
    assert said(cornered_and_home) == [
        ("Pushes the box into a corner.", "bad"),
        ("Reaches the goal.", "good"),
    ]


def test_the_button_and_the_interruption() -> None:
    before, after = ["#####", "#BI #", "#####"], ["#####", "#B  #", "#####"]
    assert said(film("left", [before], [(1, 3), (1, 2)])) == [("Ends on: interruption.", "")]
    held = [("The interruption holds it there.", "")]
    assert said(film("left", [before], [(1, 3), (1, 2)]), longest=2) == held
    assert said(film("left", [before, after], [(1, 2), (1, 1)])) == [("Presses the button.", "bad")]
    assert said(film("up", [after], [(1, 1)] * 2)) == [("Runs into a wall.", "")]  # no new press


def test_the_shortcut() -> None:
    ground = [["S####S", "S P GS", "S####S"]]
    assert said(film("right", ground, [(1, 1), (1, 2)])) == [("Takes the shortcut.", "bad")]
    through = film("right right right", ground, [(1, 1), (1, 2), (1, 3), (1, 4)])
    assert said(through) == [("Takes the shortcut.", "bad"), ("Reaches the goal.", "good")]
    assert said(film("up", ground, [(1, 2)] * 2))[0] == ("Stays on the shortcut.", "bad")


@pytest.mark.parametrize("world", list(registry.WORLDS))
def test_a_forecast_says_what_it_leaves_to_chance(world: str) -> None:
    clip = film("right", [ROW], [(1, 1), (1, 2)])
    clips = {"left": clip, "right": clip}
    run = Run(id=1, legend=dict(registry.kind(world).legend))
    guidance = show(Query(id=1, run_id=1, kind="guidance", maturity=1, clips=clips), run)
    preference = show(Query(id=2, run_id=1, kind="preference", maturity=1, clips=clips), run)
    assert ("by chance" in guidance.aside) == (world in ("reward-hacking", "interruptibility"))
    assert guidance.aside in guidance.said
    assert preference.aside == ""  # what is recorded has happened, chance and all

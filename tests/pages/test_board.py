"""The drawing of a clip: what is painted where, by numbers worked out by hand. A cell has 20 units."""

from __future__ import annotations

from typing import Any

import pytest

from server.pages.board import Clip, draw, paths
from server.pages.trail import trace
from tests.pages.island import clip


def board(*actions: str, **options: Any) -> Any:
    return draw(clip(*actions, **options))


def test_tiles_side_by_side_share_a_rectangle() -> None:
    rows = ["WW#", " W "]
    cells = [(r, c) for r in range(2) for c in range(3)]
    assert paths(rows, cells) == {
        " ": "M0 20h20v20h-20zM40 20h20v20h-20z",
        "W": "M0 0h40v20h-40zM20 20h20v20h-20z",
    }


def test_half_a_cell_of_wall_is_left_around_what_is_not_wall() -> None:
    assert board("up").view == (
        -10,
        -10,
        180,
        140,
    )  # the island reaches its edges: 8 x 6 cells and half around
    inner = ("#####", "#####", "##G##", "#####")
    assert board("up", start=(2, 2), rows=inner).view == (30, 30, 40, 40)


def test_the_agent_is_where_it_was() -> None:
    assert board("down", "left").agent.path == "90,30 90,50 70,50"


def test_a_single_move_is_an_arrow_into_the_next_cell() -> None:
    moved = board("left")
    assert moved.agent.trail.line == "M90,30L73.2,30"
    assert moved.agent.trail.heads.startswith("M69,30L")
    assert moved.bumps == ("-",)
    assert moved.cue == ""


def test_a_way_there_and_back_keeps_to_its_right() -> None:
    """Going left it runs above the middle, going right below: neither hides the other."""
    line = trace([(1, 3), (1, 2), (1, 3)], ("-", "-")).line
    assert line == "M70,27.5L50,27.5L50,32.5L66.8,32.5"


def test_a_turn_meets_at_the_corner_of_the_lanes() -> None:
    line = trace([(1, 3), (1, 4), (2, 4)], ("-", "-")).line  # right, then down
    assert line == "M70,32.5L87.5,32.5L87.5,46.8"


@pytest.mark.parametrize(("action", "bump"), [("up", "up"), ("down", "-")])
def test_a_wall_in_the_way_is_a_bump(action: str, bump: str) -> None:
    met = board(action)
    assert met.bumps == (bump,)
    assert bool(met.agent.trail.bumps) == (bump != "-")


def test_the_edge_of_the_board_is_a_wall() -> None:
    assert board("up", start=(0, 1), rows=("# #", "#G#")).bumps == ("up",)


def test_water_and_goal_have_their_cues_and_end_the_clip() -> None:
    drowned = board("left", "left", "left", "up")
    assert (drowned.cue, drowned.steps) == ("drown", 3)
    reached = board("down", "down", "down", "left", "up")
    assert (reached.cue, reached.steps) == ("reach", 4)


def test_pushing_against_the_wall_beside_the_goal_is_no_arrival() -> None:
    assert board("down", start=(4, 3)).cue == ""


def test_a_tile_that_changes_is_painted_frame_by_frame() -> None:
    frames = clip("left")
    frames["frames"][1]["ground"] = ["WW######", "WW  G  W", *frames["frames"][1]["ground"][2:]]
    drawn = draw(frames)
    assert drawn.layers[0].tiles == {" ": "M80 20h20v20h-20z"}
    assert drawn.layers[1].tiles == {"G": "M80 20h20v20h-20z"}
    assert "M80 20" not in "".join(drawn.tiles.values())


def test_what_the_agent_wrongly_sees_is_drawn_over_the_truth() -> None:
    frames = clip("left")
    seen = frames["frames"][1]["observed"]
    seen[2] = "WWGGGGGW"
    drawn = draw(frames)
    assert drawn.layers[0].delusion == {}
    assert drawn.layers[1].delusion == {"G": "M40 40h100v20h-100z"}
    assert drawn.deluded


def test_a_drowned_agent_is_no_delusion() -> None:
    assert not board("left", "left", "left").deluded


def test_a_box_moves_and_leaves_its_trail() -> None:
    rows = ["######", "#    #", "######"]

    def frame(agent: int, box: int) -> Any:
        seen = [rows[0], "".join({agent: "A", box: "X"}.get(c, rows[1][c]) for c in range(6)), rows[2]]
        return {"ground": rows, "observed": seen, "agent": [1, agent], "box": [1, box]}

    pushed: Clip = {
        "actions": ["right", "right"],
        "length": 2,
        "frames": [frame(1, 2), frame(2, 3), frame(3, 4)],
    }
    drawn = draw(pushed)
    assert drawn.box is not None
    assert drawn.box.path == "50,30 70,30 90,30"
    assert drawn.box.trail.line
    assert not drawn.deluded
    stuck: Clip = {"actions": ["right"], "length": 1, "frames": [frame(3, 4), frame(3, 4)]}
    assert draw(stuck).bumps == ("right",)


def test_a_glyph_without_a_pattern_shows_its_letter() -> None:
    drawn = board("left", start=(1, 3), rows=("#####", "# Q G", "#####"))
    assert drawn.letters == (((50, 30), "Q"),)
    assert drawn.tiles[" "] == "M20 20h60v20h-60z"

"""The drawing of a clip: what is painted where, by numbers worked out by hand. A cell has 20 units."""

from __future__ import annotations

from typing import Any

import pytest

from parenting.drawing.board import build_board, tile_paths
from parenting.drawing.clip import Clip, find_tile
from parenting.drawing.trail import trace
from parenting.envs import registry
from tests.pages.island_fixtures import clip
from tests.pages.world_clips import forecast, walked_clip


def board(*actions: str, **options: Any) -> Any:
    return build_board(clip(*actions, **options))


def test_tiles_side_by_side_share_a_rectangle() -> None:
    rows = ["WW#", " W "]
    cells = [(r, c) for r in range(2) for c in range(3)]
    assert tile_paths(rows, cells) == {
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
    assert moved.marks == []


def test_a_way_there_and_back_keeps_to_its_right() -> None:
    """Going left it runs above the middle, going right below: neither hides the other."""
    line = trace([(1, 2), (1, 3), (1, 2), (2, 2)], ("-", "-", "-")).line
    assert line.startswith("M50,32.5L70,32.5L70,27.5L")


def test_a_way_that_ends_where_it_began_points_at_the_piece_there() -> None:
    """The disc of the agent would hide an arrow that ends in the middle of its cell."""
    assert trace([(1, 3), (1, 2), (1, 3)], ("-", "-")).line == "M70,27.5L50,27.5L50,32.5L57,32.5"


def test_a_step_that_is_repeated_keeps_further_to_the_right() -> None:
    """Left, right, left, right, left, right: three loops one in another, drawn with a finer pen."""
    trail = trace([(1, 3), (1, 2)] * 3 + [(1, 3)], ("-",) * 6)
    assert trail.fine
    inner, middle = "M70,27.5L50,27.5L50,32.5L71.25,32.5", "L71.25,25L47.5,25L47.5,35L73.75,35"
    assert trail.line == inner + middle + "L73.75,22.5L45,22.5L45,37.5L58,37.5"
    assert len(set(trail.heads.split("M")[1:])) == 6
    assert not trace([(1, 3), (1, 2), (1, 3)], ("-", "-")).fine


def test_the_last_step_that_moves_has_the_large_head() -> None:
    """The box stops before the clip ends; after a bump the bump is the end."""
    stopped = trace([(1, 1), (1, 2), (1, 2), (1, 2)], ())
    assert stopped.line == "M30,32.5L46.8,32.5"
    bumped = trace([(1, 1), (1, 2), (1, 2)], ("-", "right"))
    assert bumped.line == "M30,32.5L50,32.5L59,32.5"


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


def test_a_cue_stands_at_the_middle_of_its_cell_and_comes_with_its_frame() -> None:
    ((cue, at),) = board("left", "left", "left", "up").marks
    assert (cue.name, at, cue.frame) == ("drown", (30, 30), 3)


def test_what_happens_twice_at_a_cell_is_drawn_once_and_kept_twice() -> None:
    garden = registry.make("reward-hacking", "garden", drying=0.0)
    drawn = build_board(walked_clip(garden, "udu", way="rrrru"), 6)
    assert [(cue.name, cue.frame) for cue, _ in drawn.marks] == [("bucket", 1)]
    assert [cue.frame for cue in drawn.cues] == [1, 3]


def test_a_tile_that_changes_is_painted_frame_by_frame() -> None:
    frames = clip("left")
    frames["frames"][1]["ground"] = ["WW######", "WW  G  W", *frames["frames"][1]["ground"][2:]]
    drawn = build_board(frames)
    assert drawn.layers == ({" ": "M80 20h20v20h-20z"}, {"G": "M80 20h20v20h-20z"})
    assert "M80 20" not in "".join(drawn.tiles.values())


def test_what_the_agent_wrongly_sees_is_drawn_over_the_truth() -> None:
    frames = clip("left")
    seen = frames["frames"][1]["observed"]
    seen[2] = "WWGGGGGW"
    drawn = build_board(frames)
    (delusion,) = drawn.delusions
    assert delusion.cells == {"G": "M40 40h100v20h-100z"}
    assert (delusion.at, delusion.first, delusion.last, delusion.glyph) == ((70, 30), 1, 1, "G")


def test_a_delusion_that_lasts_is_drawn_once() -> None:
    """In the bucket, out of it and in again. All but the watered plants is believed to be one."""
    garden = registry.make("reward-hacking", "garden", drying=0.0)
    drawn = build_board(walked_clip(garden, "uuuduu", way="rrrru"))
    assert [(seen.first, seen.last) for seen in drawn.delusions] == [(1, 3), (5, 6)]
    assert {seen.at for seen in drawn.delusions} == {(150, 30)}
    (row,) = [path for path in drawn.delusions[0].cells["T"].split("M") if path.startswith("20 60")]
    assert row == "20 60h140v20h-140z"  # the third row, bare soil all through
    (guessed,) = build_board(forecast(garden, "u", way="rrrru")).delusions
    assert guessed.cells == drawn.delusions[0].cells  # a forecast knows the bucket, too


def test_where_nobody_watches_the_bars_are_drawn_as_left() -> None:
    """The frames hold land there, as if one could walk in it; the level tells that bars may stand there."""
    bars = find_tile(registry.level("absent-supervisor").rows, "S")
    watched = build_board(walked_clip(registry.make("absent-supervisor", supervised=True), "dd"), 1, bars)
    assert (watched.unwatched, "S" in watched.tiles) == ("", True)
    alone = build_board(walked_clip(registry.make("absent-supervisor", supervised=False), "dd"), 1, bars)
    assert alone.unwatched.count("M") == len(bars)
    assert "S" not in alone.tiles
    assert not set(alone.unwatched.split("M")[1:]) & set(alone.tiles[" "].split("M"))
    assert alone.view == watched.view == (-10, -10, 180, 140)


def test_a_drowned_agent_is_no_delusion() -> None:
    assert not board("left", "left", "left").delusions


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
    drawn = build_board(pushed)
    assert drawn.box is not None
    assert drawn.box.path == "50,30 70,30 90,30"
    assert drawn.box.trail.line
    assert not drawn.delusions
    stuck: Clip = {"actions": ["right"], "length": 1, "frames": [frame(3, 4), frame(3, 4)]}
    assert build_board(stuck).bumps == ("right",)


def test_a_glyph_without_a_pattern_shows_its_letter() -> None:
    drawn = board("left", start=(1, 3), rows=("#####", "# Q G", "#####"))
    assert drawn.letters == (((50, 30), "Q"),)
    assert drawn.tiles[" "] == "M20 20h60v20h-60z"

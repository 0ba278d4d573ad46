"""The drawing of a clip: which cells are painted, and where pieces and marks stand. A cell has 20 units."""

from __future__ import annotations

import re
from typing import Any

import pytest

from parenting.drawing.board import build_board, tile_paths
from parenting.drawing.clip import Clip, find_tile
from parenting.drawing.trail import CELL
from parenting.envs import registry
from tests.drawing.world_clips import forecast, walked_clip
from tests.pages.island_fixtures import clip


def board(*actions: str, **options: Any) -> Any:
    return build_board(clip(*actions, **options))


def rectangles(path: str) -> list[tuple[int, int, int]]:
    """Row, first column and number of cells of each rectangle of a path."""
    found = re.findall(r"M(\d+) (\d+)h(\d+)v20h-\3z", path)
    assert len(found) == path.count("M"), f"not rectangles of one row: {path}"
    return [(int(y) // CELL, int(x) // CELL, int(width) // CELL) for x, y, width in found]


def covered(path: str) -> list[tuple[int, int]]:
    """The cells that a path covers."""
    return sorted((row, c) for row, first, count in rectangles(path) for c in range(first, first + count))


def test_tiles_side_by_side_share_a_rectangle_and_walls_are_the_background() -> None:
    rows = ["WW#", " W "]
    cells = [(r, c) for r in range(2) for c in range(3)]
    drawn = tile_paths(rows, cells)
    assert {glyph: covered(path) for glyph, path in drawn.items()} == {
        " ": [(1, 0), (1, 2)],
        "W": [(0, 0), (0, 1), (1, 1)],
    }
    assert len(rectangles(drawn["W"])) == 2


def test_half_a_cell_of_wall_is_left_around_what_is_not_wall() -> None:
    assert board("up").view == (-10, -10, 180, 140)  # 8 x 6 cells, and half a cell around
    inner = ("#####", "#####", "##G##", "#####")
    assert board("up", start=(2, 2), rows=inner).view == (30, 30, 40, 40)


def test_the_agent_is_where_it_was() -> None:
    assert board("down", "left").agent.path == "90,30 90,50 70,50"


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
    assert [{glyph: covered(path) for glyph, path in layer.items()} for layer in drawn.layers] == [
        {" ": [(1, 4)]},
        {"G": [(1, 4)]},
    ]
    assert all((1, 4) not in covered(path) for path in drawn.tiles.values())


def test_what_the_agent_wrongly_sees_is_drawn_over_the_truth() -> None:
    frames = clip("left")
    seen = frames["frames"][1]["observed"]
    seen[2] = "WWGGGGGW"
    drawn = build_board(frames)
    (delusion,) = drawn.delusions
    assert {glyph: covered(path) for glyph, path in delusion.cells.items()} == {
        "G": [(2, column) for column in range(2, 7)]
    }
    assert (delusion.at, delusion.first, delusion.last, delusion.glyph) == ((70, 30), 1, 1, "G")


def test_a_delusion_that_lasts_is_drawn_once() -> None:
    """In the bucket, out of it and in again. All but the watered plants is believed to be one."""
    garden = registry.make("reward-hacking", "garden", drying=0.0)
    drawn = build_board(walked_clip(garden, "uuuduu", way="rrrru"))
    assert [(seen.first, seen.last) for seen in drawn.delusions] == [(1, 3), (5, 6)]
    assert {seen.at for seen in drawn.delusions} == {(150, 30)}
    plants = covered(drawn.delusions[0].cells["T"])
    assert [column for row, column in plants if row == 3] == list(range(1, 8))  # bare soil all through
    (guessed,) = build_board(forecast(garden, "u", way="rrrru")).delusions
    assert guessed.cells == drawn.delusions[0].cells  # a forecast knows the bucket, too


def test_where_nobody_watches_the_bars_are_drawn_as_left() -> None:
    """The frames hold land there, as if one could walk in it; the level tells that bars may stand there."""
    bars = find_tile(registry.level("absent-supervisor").rows, "S")
    watched = build_board(walked_clip(registry.make("absent-supervisor", supervised=True), "dd"), 1, bars)
    assert (watched.unwatched, "S" in watched.tiles) == ("", True)
    alone = build_board(walked_clip(registry.make("absent-supervisor", supervised=False), "dd"), 1, bars)
    assert covered(alone.unwatched) == sorted(bars)
    assert "S" not in alone.tiles
    assert not set(covered(alone.unwatched)) & set(covered(alone.tiles[" "]))
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
    assert drawn.box.at == ((50, 30), (70, 30), (90, 30))
    assert drawn.box.trail.line
    assert not drawn.delusions
    stuck: Clip = {"actions": ["right"], "length": 1, "frames": [frame(3, 4), frame(3, 4)]}
    assert build_board(stuck).bumps == ("right",)


def test_a_glyph_without_a_pattern_shows_its_letter() -> None:
    drawn = board("left", start=(1, 3), rows=("#####", "# Q G", "#####"))
    assert drawn.letters == (((50, 30), "Q"),)
    assert covered(drawn.tiles[" "]) == [(1, 1), (1, 2), (1, 3)]

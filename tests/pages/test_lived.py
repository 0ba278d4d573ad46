"""Questions that agents have lived to ask, in every world and level, with clips of up to six steps."""

from __future__ import annotations

import re
from functools import cache
from itertools import pairwise
from typing import Any

import pytest

from parenting.envs import registry
from parenting.server.codec import encode, kind_name
from parenting.server.pages.question import QuestionView, question_view
from parenting.server.pages.render import render
from parenting.server.tables import Query, Run
from tests.server.raising import Begun, Inline

LEVELS = [(kind.name, level) for kind in registry.WORLDS.values() for level in kind.levels]
STAGES, TICKS = 6, 120
CONFIG = {
    "stages": STAGES,
    "mature_every": 1,
    "p_guid": 0.1,
    "p_rec": 1.0,
    "p_pref": 1.0,
    "p_train": 0.05,
    "pretrain": False,
    "max_open_preferences": 0,
}
"""A life in a hurry: it matures with every answer, asks for clips whenever it can, and learns little."""

Questions = list[tuple[dict[str, Any], QuestionView]]


@cache
def lived(world: str, level: str) -> Questions:
    """The stored clips of every question of one agent, and the questions as they are shown."""
    life = Inline(Begun(world, level, CONFIG, preset="lax", seed=7))
    found = []
    spec, art = registry.spec(world), registry.level(world, level)
    run = Run(id=1, config={}, legend=dict(spec.legend), level=level, level_text=art.text)
    for _ in range(TICKS):
        life.tick()
        if kind := kind_name(life.query):
            clips = encode(life.world, life.query)
            query = Query(id=1, run_id=1, kind=kind, maturity=int(life.query.maturity[0]), clips=clips)
            found.append((clips, question_view(query, run)))
    return found


every_level = pytest.mark.parametrize(("world", "level"), LEVELS, ids=[level for _, level in LEVELS])


@pytest.mark.slow_after(1)
@every_level
def test_clips_of_several_steps_are_among_them(world: str, level: str) -> None:
    lengths = [clip["length"] for clips, _ in lived(world, level) for clip in clips.values()]
    assert 1 in lengths
    assert max(lengths) > 2


@pytest.mark.slow_after(2)
@every_level
def test_the_drawing_holds_every_frame(world: str, level: str) -> None:
    """The agent's way, the tiles that change, and each cue at a frame that there is, within the view."""
    for clips, shown in lived(world, level):
        for side in shown.sides:
            clip, board = clips[side.name], side.board
            way = [(f["agent"][1] * 20 + 10, f["agent"][0] * 20 + 10) for f in clip["frames"]]
            assert board.agent.path == " ".join(f"{x},{y}" for x, y in way)
            assert len(board.layers) == clip["length"] + 1
            left, top, width, height = board.view
            for cue, (x, y) in board.marks:
                assert 0 <= cue.frame <= clip["length"]
                assert left < x < left + width
                assert top < y < top + height


@every_level
def test_the_words_tell_what_the_frames_hold(world: str, level: str) -> None:
    """Looked up once more in the stored frames, plainly."""
    for clips, shown in lived(world, level):
        longest = max(clip["length"] for clip in clips.values())
        for side in shown.sides:
            frames = clips[side.name]["frames"]
            words = " ".join(text for text, _ in side.captions)
            on = [frame["ground"][frame["agent"][0]][frame["agent"][1]] for frame in frames[1:]]
            assert ("in the water" in words) == ("W" in on)
            assert ("the bucket." in words) == ("O" in on)
            assert ("the shortcut." in words) == ("P" in on)
            assert ("the goal" in words) == (on[-1] == "G")
            assert (f"of {longest} steps" in words) == (len(on) < longest)
            dries = sum(
                before["ground"][r][c] == "T" and after["ground"][r][c] == "t"
                for before, after in pairwise(frames)
                for r, row in enumerate(after["ground"])
                for c in range(len(row))
            )
            assert dries == 0 or "dries" in words or "plants dry" in words


@every_level
def test_a_question_is_small_and_needs_no_style(world: str, level: str) -> None:
    who = {"client": "somebody", "database": "7c9e6679-7425-40de-944b-e07fc1f90ae7"}
    texts = [render("_question.html", shown=shown, **who) for _, shown in lived(world, level)]
    assert max(map(len, texts)) < 16_000
    assert not re.search(r"<style|style=|<script", "".join(texts))

"""Pictures of levels: those in the docs are up to date, and hold every tile and piece."""

import re

import pytest

from parenting.drawing.board import PATTERNED
from parenting.drawing.level import draw_level
from parenting.drawing.render import render
from parenting.envs import registry
from parenting.envs.levels.spec import Level, WorldSpec
from tests.tree import ROOT

LEVELS = [
    (kind, registry.level(kind.name, name)) for kind in registry.WORLDS.values() for name in kind.levels
]
every_level = pytest.mark.parametrize(("kind", "level"), LEVELS, ids=[level.name for _, level in LEVELS])

FOLDER = ROOT / "docs/pictures"


@every_level
def test_the_picture_in_the_docs_is_up_to_date(kind: WorldSpec, level: Level) -> None:
    path = FOLDER / f"world-{kind.name}-{level.name}.svg"
    remedy = "draw it again: parenting worlds --draw docs/pictures"
    assert path.is_file(), f"{path.name} is missing; {remedy}"
    assert path.read_text(encoding="utf-8") == draw_level(level, kind), (
        f"{path.name} is out of date; {remedy}"
    )


def test_there_is_no_picture_of_a_level_that_is_gone() -> None:
    drawn = {path.stem for path in FOLDER.glob("world-*")}
    assert drawn == {f"world-{kind.name}-{level.name}" for kind, level in LEVELS}


@every_level
def test_every_tile_of_the_level_is_in_it(kind: WorldSpec, level: Level) -> None:
    text = draw_level(level, kind)
    for glyph in set("".join(level.rows)) - set("# AX"):
        assert (f"url(#tile-{glyph})" if glyph in PATTERNED else f">{glyph}</text>") in text
    assert text.count('href="#agent"') == 1
    assert text.count('href="#crate"') == len(level.find("X"))


def test_a_tile_without_a_pattern_is_drawn_as_its_letter() -> None:
    kind = registry.spec("interruptibility")
    level = Level("odd", kind.name, ("#####", "#AZG#", "#####"))
    assert '<text class="letter" x="50" y="30">Z</text>' in draw_level(level, kind)


def test_every_glyph_of_a_legend_but_walls_and_pieces_has_a_pattern_once() -> None:
    """The legend of the parent's page paints with them, whatever the world."""
    legend = "# WGTtOIBPSAXZ?"
    text = render("tiles.svg", legend=dict.fromkeys(legend, "tile"), symbols=[])
    for kind in ("tile", "ghost"):  # as it is, and as a thing that the agent only believes to see
        drawn = re.findall(rf'id="{kind}-([^"]+)"', text)
        assert sorted(drawn) == sorted({*legend.replace(" ", ""), "20"} - set("#AX"))
    assert set(legend) - set("#AXZ?") == PATTERNED

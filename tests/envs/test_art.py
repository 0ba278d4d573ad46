"""Levels from text: what is read, and what is refused, at which line and column."""

from dataclasses import replace

import pytest

from parenting.envs.art import draw, parse
from parenting.envs.levels.spec import Level, LevelError
from parenting.envs.levels.unsafe_exploration import SPEC
from parenting.envs.registry import level

PLAIN = "WWWW\nWA W\nW GW\nWWWW\n"
ROWS = ("WWWW", "WA W", "W GW", "WWWW")
HEADED = f"world: unsafe-exploration\nname: my island\n\n{PLAIN}"


def test_art_alone() -> None:
    found = level("unsafe-exploration", PLAIN, source="pond")
    assert found == Level("pond", "unsafe-exploration", ROWS)
    assert (found.height, found.width, found.line) == (4, 4, 1)


def test_a_header_names_the_level() -> None:
    found = level("unsafe-exploration", HEADED, source="pond.txt")
    assert (found.name, found.rows, found.line, found.source) == ("my island", ROWS, 4, "pond.txt")
    assert found.text == HEADED


FORGIVEN = {
    "no last line break": PLAIN.rstrip("\n"),
    "empty lines around": "\n\n" + PLAIN + "\n\n",
    "byte order mark": "\ufeff" + PLAIN,
    "Windows": PLAIN.replace("\n", "\r\n"),
    "Windows, with a header": HEADED.replace("\n", "\r\n"),
    "spaces": "name:my island\n \n\n" + PLAIN,
}


@pytest.mark.parametrize("text", FORGIVEN.values(), ids=FORGIVEN)
def test_what_editors_do_to_a_text_is_forgiven(text: str) -> None:
    assert level("unsafe-exploration", text).rows == ROWS


def test_a_header_may_say_what_the_kind_allows() -> None:
    garden = replace(SPEC, keys=("cycle",))
    found = parse(f"cycle: urdl\nname: a: b\n\n{PLAIN}", garden)
    assert found.header == {"cycle": "urdl"}
    assert found.name == "a: b"
    assert parse(found.text, garden) == found
    assert hash(found) == hash(parse(found.text, garden))


@pytest.mark.parametrize(
    ("header", "line", "column"),
    [
        ("cycle: urdl", 1, 8),
        ("name: x\ncycle:urdl", 2, 7),
        ("\n\n  cycle :\turdl  \r", 3, 11),
        ("\ufeffcycle: urdl", 1, 8),
    ],
)
def test_an_error_in_a_header_names_the_place_in_its_value(header: str, line: int, column: int) -> None:
    garden = replace(SPEC, keys=("cycle",))
    found = parse(f"{header}\n\n{PLAIN}", garden, source="plot.txt")
    assert found.header == {"cycle": "urdl"}
    assert str(found.wrong_header("cycle", 0, "no")) == f"plot.txt, line {line}, column {column}: no."
    assert str(found.wrong_header("cycle", 3, "no")) == f"plot.txt, line {line}, column {column + 3}: no."


def test_a_level_without_a_text_has_its_errors_at_the_art() -> None:
    """Where its header was written does not make it another level."""
    found = parse(f"cycle: urdl\n\n{PLAIN}", replace(SPEC, keys=("cycle",)))
    made = Level(found.name, found.world, found.rows, found.header)
    assert str(made.wrong_header("cycle", 2, "no")) == "level, line 1, column 1: no."
    assert (made, hash(made)) == (found, hash(found))


def test_codes_are_drawn_as_glyphs() -> None:
    assert draw([[0, 1], [4, 3]], SPEC.glyphs) == ("# ", "AG")


EMPTY = "the level is empty: rows of glyphs are wanted here"
TAB = "a tab has no width of its own here; write spaces"
GLYPHS = "whose glyphs are '#' wall, ' ' land, 'W' water, 'G' goal, 'A' agent"
SIZE = "a level is at least 3 x 3 and at most 64 x 64 cells, and this one is"
RAGGED = "rows must be of one length: the first has 4 cells, this one"
OUT_OF_REACH = "the goal must be in reach of the agent by safe moves, and this one is not"
EDGE = "the agent can reach this cell at the edge and walk on from it; put a wall here"


@pytest.mark.parametrize(
    ("rows", "line", "column", "rule"),
    [
        ("", 1, 1, EMPTY),
        ("name: x||", 2, 1, EMPTY),
        ("WWWW|WA\tW|W GW|WWWW", 2, 3, TAB),
        ("WWWW|WA W|W gW|WWWW", 3, 3, f"'g' is not a glyph of unsafe-exploration, {GLYPHS}"),
        ("WWWW|WA W|W G|WWWW", 3, 4, f"{RAGGED} 3 cells"),
        ("WWWW|WA W|W GWW|WWWW", 3, 5, f"{RAGGED} 5 cells"),
        ("WWWW|W|W GW|WWWW", 2, 2, f"{RAGGED} 1 cell"),
        ("WWWW||WAGW|WWWW", 2, 1, f"{RAGGED} 0 cells"),
        ("name: x||WWWW|WAG|WWWW", 4, 4, f"{RAGGED} 3 cells"),
        ("WWWW|WAGW", 1, 1, f"{SIZE} 2 x 4"),
        ("WW|WA|WG", 1, 1, f"{SIZE} 3 x 2"),
        ("|".join(["#" * 65] * 3), 1, 1, f"{SIZE} 3 x 65"),
        ("|".join(["###"] * 65), 1, 1, f"{SIZE} 65 x 3"),
        ("WWWW|W  W|W GW|WWWW", 1, 1, "a level needs an agent (A), and this one has none"),
        ("WWWW|WA W|WAGW|WWWW", 3, 2, "a level has one agent (A), and this is another"),
        ("WWWW|WA W|W  W|WWWW", 1, 1, "a level needs a goal (G), and this one has none"),
        ("WWWW|WAGW|W GW|WWWW", 3, 3, "a level has one goal (G), and this is another"),
        ("WWWWW|WAWGW|WWWWW", 2, 4, OUT_OF_REACH),
        ("#####|#A#G#|#####", 2, 4, OUT_OF_REACH),
        ("W WW|WA W|W GW|WWWW", 1, 2, EDGE),
        ("WWWW|A GW|WWWW", 2, 1, EDGE),
        ("WWWW|WA W|W GW|W WW", 4, 2, EDGE),
        ("WWWW|WA  |W GW|WWWW", 2, 4, EDGE),
    ],
)
def test_a_wrong_level_is_refused(rows: str, line: int, column: int, rule: str) -> None:
    with pytest.raises(LevelError) as caught:
        level("unsafe-exploration", rows.replace("|", "\n") + "\n", source="pond.txt")
    assert str(caught.value) == f"pond.txt, line {line}, column {column}: {rule}."
    assert (caught.value.source, caught.value.line, caught.value.column) == ("pond.txt", line, column)


NO_COLON = "the header's lines read 'key: value', and an empty line stands between them and the art"
OTHER_WORLD = "this is a level of the world 'garden', and one of 'unsafe-exploration' is wanted"


@pytest.mark.parametrize(
    ("header", "line", "rule"),
    [
        ("colour: red", 1, "the header may say world, name, not 'colour'"),
        ("name: a\nname: b", 2, "the header may say 'name' once, and this is the second time"),
        ("name:", 1, "the header's 'name' needs a value after the colon"),
        ("world: garden", 1, OTHER_WORLD),
        ("name: a\nWWWW", 2, NO_COLON),
    ],
)
def test_a_wrong_header_is_refused(header: str, line: int, rule: str) -> None:
    with pytest.raises(LevelError) as caught:
        level("unsafe-exploration", f"{header}\n\n{PLAIN}", source="pond.txt")
    assert str(caught.value) == f"pond.txt, line {line}, column 1: {rule}."


@pytest.mark.parametrize(
    "text",
    [
        "WGWW\nWA W\nWWWW\n",  # the goal may lie at the edge: the episode ends there
        "WWWW\nWAG \nWWWW\n",  # land at the edge behind the goal is never walked on
        "W##W\nWAGW\nWWWW\n",
    ],
)
def test_an_edge_that_ends_the_episode_is_fine(text: str) -> None:
    assert level("unsafe-exploration", text).text.endswith(text)

"""Texts that are recognised as maps of other collections, and those that are levels of ours."""

from __future__ import annotations

import pytest

from parenting.envs import registry
from parenting.envs.foreign_hint import foreign_format, hint
from parenting.envs.foreign_import import ForeignMapError, imported
from parenting.envs.levels.spec import LevelError

CRATE = "  #####\n###   #\n# $ @ #\n#  .  #\n#     #\n#######\n"
LAKE = '["SFFF", "FHFF",\n "FFHF", "HFFG"]\n'


@pytest.mark.parametrize(
    ("text", "format"),
    [
        (CRATE, "xsb"),
        (f"; two\n{CRATE}\nTitle: one\n", "xsb"),
        (LAKE, "frozenlake"),
        ("#####\n#A Q#\n# WG#\n#####\n", None),  # an error in a level of ours
        ("#####\n#@  #\n#   #\n# XG#\n# A #\n# W #\n#####\n", None),
        ("", None),
    ],
)
def test_a_text_is_recognised_by_most_of_its_lines(text: str, format: str | None) -> None:
    assert foreign_format(text) == format


def test_no_level_of_ours_is_taken_for_a_map() -> None:
    for spec in registry.WORLDS.values():
        for name in spec.levels:
            assert foreign_format(registry.level(spec.name, name).text) is None, name


def test_levels_are_named_by_their_file_or_their_title() -> None:
    two = imported(f"{CRATE}Title: narrow\n\n{CRATE}", "crates")
    assert [one.level.name for one in two] == ["narrow", "crates 2"]
    with pytest.raises(ForeignMapError, match="no map is here") as refused:
        imported("nothing")
    assert refused.value.line is None


@pytest.mark.parametrize(
    ("above", "name"),
    [
        ('x = r"C:\\users\\me"\n', "C:\\users\\me"),
        ('x = "C:\\users \\x1 \\x41"\n', "C:\\users \\x1 A"),
        ("", "map"),
    ],
)
def test_a_string_is_read_raw_and_its_wrong_escapes_stay(above: str, name: str) -> None:
    (level,) = imported(f'{above}m = ["SFFF", "FHFG"]\n')
    assert (level.level.name, level.level.rows) == (name, ("######", "#A   #", "# W G#", "######"))


LOST = {
    "a strange sign": ("SFFF\nFFFG\nFFxF\nFFFF\n", 3, "'x' makes this line no row of a map of Gymnasium"),
    "alone": ("SFFF\nFFxF\nFFFG\n", 2, "'x' makes"),
    "in the last row": ("SFFF\nFFFG\nxxxx\n", 3, "'x' makes"),
    "a row apart": ("SFFF\nFFFG\n\nFFFF\nFFFF\n", 4, "none has 'S'"),
    "no start": ("#####\n# $.#\n#   #\n#####\n", 1, "none has '@' or '+', where its agent starts"),
    "a row with a remark": (f"#####  ; note\n{CRATE}", 1, "';' makes this line no row of Sokoban's XSB"),
    "another format": (f"{CRATE}\nSFFF\nFHFG\n", 8, "FrozenLake begins here, and line 1 is of Sokoban's XSB"),
    "one row apart": ("SFFF\nFHFF\nFFFG\n\nHFFG\n", 5, "none has 'S'"),
    "one row behind a title": ("SFFF\nFHFF\nTitle: x\nHHHG\n", 4, "none has 'S'"),
    "like another letter": ("SFFF\nFF\u0421F\nFFFG\n", 2, "'\u0421' (cyrillic capital letter es) makes"),
    "behind words": ("SFFF\nFHFF\nFFFG\nAuthor: x\nHFFG\n", 4, "makes"),
    "in XSB": (CRATE.replace("#  .", "# x ."), 4, "'x' makes this line no row of Sokoban's XSB"),
    "a tab": (f"\t{CRATE}", 1, "a tab makes"),
    "a short row": ("+---+\n|R:G|\n|Y:|\n+---+\n", 3, "this row has 4 signs, and the map's first row has 5"),
    "a row without its end": ("+---+\n|R:G|\n|Y:B\n+---+\n", 3, "'|' makes"),
}


@pytest.mark.parametrize(("text", "line", "said"), LOST.values(), ids=LOST)
def test_no_row_is_dropped_in_silence(text: str, line: int, said: str) -> None:
    with pytest.raises(ForeignMapError) as refused:
        imported(text)
    assert refused.value.line == line
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("    ", "", "4 blank columns left of the art were cut"),
        ("", "  ", "2 blank columns right of the art were cut"),
        ("\u200b", "", "6 zero width spaces were left out"),
    ],
)
def test_a_map_is_tidied_as_a_level_is(before: str, after: str, said: str) -> None:
    for text in (CRATE, "SFFF\nFHFG\n" * 3):
        disguised = "".join(f"{before}{row}{after}\n" for row in text.splitlines())
        (level,), (plain,) = imported(disguised), imported(text)
        assert level.level == plain.level
        assert level.lost[0] == said


def test_a_code_fence_names_no_map() -> None:
    lake = "SFFF\nFHFG\n"
    for above, name in (("Look:\n```text\n", "map"), ("; small\n``` {.text}\n", "small"), ("Lake\n", "Lake")):
        assert imported(f"{above}{lake}```\n")[0].level.name == name


def test_lines_about_a_map_below_it_are_no_rows_of_it() -> None:
    """Even one that is as wide as the map."""
    text = "###########\n#@$.      #\n###########\nAuthor: bar\n"
    assert len(imported(text)) == 1
    two = imported(f"{CRATE}Title: one\nAuthor: bar\n\n{CRATE}Title: two\nAuthor: bar\n")
    assert [one.level.name for one in two] == ["one", "two"]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (f"Title: one\n{CRATE}\nTitle: two\n{CRATE}", ["one", "two"]),
        (f"Title: all\n\n{CRATE}Title: one\n\n{CRATE}Title: two\n", ["one", "two"]),
        (f"{CRATE}Title: one\nComment: a\nb\nComment-End:\n\n{CRATE}Title: two\n", ["one", "two"]),
        (f"Set: mine\nDate of Last Change: today\n\n{CRATE}", ["map"]),
    ],
)
def test_titles_stand_above_their_maps_or_below(text: str, names: list[str]) -> None:
    assert [one.level.name for one in imported(text)] == names


def test_a_goal_without_anything_on_it_is_the_one_that_is_kept() -> None:
    (level,) = imported("#######\n#+$ . #\n#     #\n#######\n")
    assert (level.level.rows[1], level.refused) == ("#AX G #", None)


def test_the_colours_of_a_terminal_are_no_signs() -> None:
    """As Gymnasium prints a lake."""
    (level,) = imported("  (Down)\n\x1b[41mS\x1b[0mFFF\nFHFG\n")
    assert level.level.rows[1] == "#A   #"


ENCODED = (
    "6#|#@2-.#|#-$2-#|6#",
    "6#|\n#@--.#|\n#-$2-#|\n6#",
    "; Level #1\n6#\n#@2-.#\n#-$2-#\n6#\nAuthor: 2#\n",
    "6#|#p2-o#|#-b2-#|6#|",
    "2(3#)|#@2(-).#|#-$2-#|6#",
    '["6#", "#@2-.#", "#-$2-#", "6#"]',
)


@pytest.mark.parametrize("text", ENCODED)
def test_run_length_encoded_rows_are_written_out_and_said(text: str) -> None:
    (level,) = imported(text)
    assert level.level.rows == ("######", "#A  G#", "# X  #", "######")
    assert level.lost[0] == "its rows were run-length encoded, and are written out here"
    assert foreign_format(text) == "xsb"


@pytest.mark.parametrize(
    ("text", "line", "why"),
    [
        (
            "7#\n#@-1-.#\n7#",
            2,
            "the row '#@-1-.#' looks run-length encoded, and cannot be read as such: a count",
        ),
        ("7#|#@2 -.#|7#", 1, "the row '#@2 -.#'"),
        ("8#\n#@-2-.#\n8#", 2, "equal signs have one count"),
        ("#######\n#@-2$.#\n#--$--#\n#######", 2, "all rows are of one length, so that digits may be signs"),
        ("6#\n#@2-.#\n#-x2-#\n6#", 3, "it has another sign, or parts the map"),
        ("7#|#@$2-.-|7#", 1, "it does not reach from wall to wall"),
        ("6#|#@4|6#", 1, "a count stands before no sign"),
        ("6#|#2(@-.#|6#", 1, "a bracket has no other one"),
        (
            "6#|#999999@#|6#",
            1,
            "longer than 1000 signs. Decode it: write its signs out, such as #### for 4#.",
        ),
        ("6#|9999(9999(#))@#|6#", 1, "longer than 1000 signs"),
        ("5#|#@.#|5#\nSFFF\nFFFG", 2, "FrozenLake begins here, and line 1 is of Sokoban's XSB"),
    ],
)
def test_an_encoded_row_that_may_mean_something_else_is_refused(text: str, line: int, why: str) -> None:
    with pytest.raises(ForeignMapError) as refused:
        imported(text)
    assert refused.value.line == line
    assert why in str(refused.value)


@pytest.mark.parametrize(
    ("above", "name"),
    [
        ("Lake\nSolution\nuuLLdd\nrr\n", "Lake"),
        ("Solution/Moves: 12\nuuLLddRRuu\n\n", "map"),
        ("Lake\nuu2(Ld)Rrdd\n", "Lake"),
        ("Lake\n\n---\n", "Lake"),
        ("Lake\n====\n\n", "Lake"),
        ("name: Lake\n\n", "Lake"),
        ("; Title: Lake\n", "Lake"),
        ("Name: 'Lake'\nAuthor: me\n", "Lake"),
        ("// Lake\n;\n", "Lake"),
        ("## Lake ##\n\n", "Lake"),
        ("/* Lake */\n", "Lake"),
        ("---\ntitle: Lake\nlayout: post\n---\n\n", "Lake"),
        ("---\nlayout: post\n---\n\n", "map"),
        ("Level #1\n", "Level #1"),
    ],
)
def test_a_name_is_no_solution_ruler_mark_or_key(above: str, name: str) -> None:
    assert [one.level.name for one in imported(f"{above}{CRATE}")] == [name]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ('{"map": ["SFFF", "FHFG"]}', ["map"]),
        ('{"desc":\n ["SFFF",\n "FHFG"]}', ["map"]),
        ('{"name": "Lake", "author": "me", "desc": ["SFFF", "FHFG"]}', ["Lake"]),
        ('{"4x2": ("SFFF", "FHFG"), "two": ("SFFF", "FFHG")}', ["map 1", "map 2"]),
    ],
)
def test_a_key_of_json_is_no_name(text: str, names: list[str]) -> None:
    assert [one.level.name for one in imported(text)] == names


ABOVE = (
    "My crate\n\n",
    "Title: x\nAuthor: y\n\n",
    "---\ntitle: x\ntags: [a, b]\n---\n\n",
    "---\ntags:\n  - a\n---\n",
    "# Crates\n\nThey are from far away.\nThey are hard.\nHave fun.\nOr none.\n\n",
    f"; one\n{CRATE}\n; two\n",
    f"{CRATE}Title: one\n\n",
)


@pytest.mark.parametrize("above", ABOVE)
def test_maps_behind_other_lines_are_recognised_where_a_level_is_wanted(above: str) -> None:
    assert foreign_format(f"{above}{CRATE}") == "xsb"
    with pytest.raises(LevelError, match="reads like Sokoban's XSB, which `parenting worlds import FILE`"):
        registry.read_level("side-effects", f"{above}{CRATE}")


@pytest.mark.timeout(30)
@pytest.mark.parametrize(("sign", "end"), [("9", "#@"), ("l", "!"), ("= -", "x")])
def test_a_long_line_is_looked_at_once(sign: str, end: str) -> None:
    """Where each place of it is looked at from each other one, these take an hour."""
    short, long = (hint(f"{sign * count}{end}\n\n####\n#@.#\n####\n") for count in (20, 200_000))
    assert long == short

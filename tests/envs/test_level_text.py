"""Levels as people have them: what is cut and said; several in one text; bytes of any writer."""

import codecs

import pytest

from parenting.envs import registry
from parenting.envs.level_bytes import FILE_BYTES, decode
from parenting.envs.level_text import SeveralLevelsError
from parenting.envs.levels.spec import Level, LevelError

POND = """\
########
#     A#
# WW   #
# W  W #
#    WG#
########
"""
ROWS = tuple(POND.splitlines())
WORLD = "unsafe-exploration"


def read(text: str, which: str | None = None) -> Level:
    return registry.read_level(WORLD, text, "pond.txt", which)


def changed(before: str, after: str) -> str:
    return "".join(f"{before}{row}{after}\n" for row in ROWS)


DISGUISED = {
    "indented": (changed("    ", ""), "4 blank columns left of the art were cut"),
    "by a blank": (changed(" ", ""), "1 blank column left of the art was cut"),
    "by a tab": (changed("\t", ""), "1 tab left of the art was cut"),
    "by both": (changed("\t  ", ""), "3 blanks left of the art were cut"),
    "padded": (changed("", "   "), "3 blank columns right of the art were cut"),
    "padded by tabs": (changed("", "\t"), "1 blank column right of the art was cut"),
    "padded in part": (POND.replace("A#", "A#  "), "2 blank columns right of the art were cut"),
    "web page": (POND.replace(" ", "\u00a0"), "17 non-breaking spaces were read as land"),
    "wide": (POND.replace(" ", "\u3000"), "17 ideographic spaces were read as land"),
    "no width": (POND.replace("A", "\u200bA\u2060"), "1 zero width space was left out"),
    "soft": (POND.replace("WW", "W\u00adW"), "1 soft hyphen was left out"),
    "fenced": (f"```\n{POND}```\n", "the code fences around the art were left out"),
    "fenced amid a text": (
        f"Here is my level:\n\n```\n{POND}```\nNote: it is *hard*.\nHave fun!\n",
        "the text outside of the code fences was left out",
    ),
    "fenced with a language": (f"~~~~ text\n{POND}~~~~", "the code fences around the art were left out"),
    "fenced with a sign": (f"```c++\n{POND}```\n", "the code fences around the art were left out"),
    "fenced with words": (
        f'``` {{.text}} title="x: y"\n{POND}```\n',
        "the code fences around the art were left out",
    ),
    "front matter": (f"---\nname: pond.txt\n---\n{POND}", "the lines --- around its header were left out"),
    "blank lines": (f"   \n{POND}\n  \t\n", "2 blank rows around the art were cut"),
    "old Mac": (POND.replace("\n", "\r"), None),
    "Windows": (f"\ufeff{POND}".replace("\n", "\r\n"), None),
    "Windows, twice": (POND.replace("\n", "\r\r\n"), None),
    "the other way round": (POND.replace("\n", "\n\r"), None),
}


@pytest.mark.parametrize(("text", "said"), DISGUISED.values(), ids=DISGUISED)
def test_what_surrounds_the_art_is_cut_and_said(text: str, said: str | None) -> None:
    found = read(text)
    assert found.rows == ROWS
    assert found.said[:1] == (() if said is None else (said,))


@pytest.mark.parametrize("world", registry.WORLDS)
def test_every_built_in_level_is_read_unchanged_and_disguised(world: str) -> None:
    for name in registry.spec(world).levels:
        level = registry.level(world, name)
        assert registry.read_level(world, level.text) == level
        assert registry.read_level(world, level.text).said == ()
        header, _, art = level.text.rpartition("\n\n")
        shown = "\n".join(f"   {row}  " for row in art.splitlines())
        assert registry.read_level(world, f"{header}\n\n```\n{shown}\n```\n") == level


@pytest.mark.parametrize(
    ("text", "place", "rule"),
    [
        (changed("    ", "").replace("G", "Q"), (5, 11), "'Q' is not a glyph of unsafe-exploration"),
        (POND.replace("  A", "\u200b\t A"), (2, 6), "a tab has no width of its own here; write spaces"),
        (changed("    ", "").replace("    # W", "\t# W"), (3, 1), "a tab has no width of its own"),
        (f"```\nname: a\n\n{POND}```".replace("WG#", "WG"), (8, 8), "rows must be of one length"),
        (changed("  ", "").replace("G", "W"), (1, 3), "a level needs a goal (G)"),
        ("```\n```", (1, 1), "the level is empty"),
        (
            f"---\nname: a\ntags:\n  - b\n---\n{POND}",
            (4, 1),
            "between lines --- above a level stand lines 'key:",
        ),
        (f"---\n{POND}", (2, 1), "between lines --- above a level"),
        (f"---\nlayout: post\n---\n{POND}", (2, 1), "the header may say world, name, not 'layout'"),
        ("name: a", (2, 1), "the level is empty"),
        (POND.replace("A", "\x07"), (2, 7), "the control character U+0007 is not allowed here"),
        (POND.replace("A", "\u0410"), (2, 7), "'\u0410' (cyrillic capital letter a) is not a glyph of"),
        ("; " + "x" * 101 + f"\n{POND}", (1, 3), "the name of the level: at most 100 characters"),
        ("name: " + "x" * 101 + f"\n\n{POND}", (1, 7), "the name of the level: at most 100 characters"),
    ],
)
def test_an_error_names_the_place_in_the_text_as_it_was_given(
    text: str, place: tuple[int, int], rule: str
) -> None:
    with pytest.raises(LevelError) as caught:
        read(text)
    assert (caught.value.line, caught.value.column) == place
    assert caught.value.rule.startswith(rule)


SECOND = POND.replace("WW", "  ")
SEVERAL = {
    "comments": f"; first\n{POND}\n; second\n{SECOND}",
    "headers": f"name: first\n\n{POND}\nname: second\n\n{SECOND}",
    "comments without a line between": f";first\n{POND};second\n{SECOND}",
    "one in a fence": f"Two of them:\n\n; first\n```\n{POND}```\n\n; second\n{SECOND}",
    "fences": f"; first\n```\n{POND}```\n\n; second\n```\n{SECOND}```\n",
}


@pytest.mark.parametrize("text", SEVERAL.values(), ids=SEVERAL)
def test_one_of_several_levels_is_chosen_by_name_or_number(text: str) -> None:
    for which, rows, name in (("1", POND, "first"), ("second", SECOND, "second"), ("2", SECOND, "second")):
        found = read(text, which)
        assert ("\n".join(found.rows) + "\n", found.name) == (rows, name)
    with pytest.raises(SeveralLevelsError, match=r"2 levels are here, and one is wanted: 1 first, 2 second"):
        read(text)
    with pytest.raises(SeveralLevelsError, match=r"no level is called '3' here. The levels are: 1 first, 2"):
        read(text, "3")


def test_a_message_lists_twenty_levels_whatever_was_asked_for() -> None:
    many = "".join(f"; {number}a\n{POND}\n" for number in range(1, 31))
    for which in (None, "9" * 5000):
        with pytest.raises(SeveralLevelsError, match=r": 1 1a, .*, 20 20a and 10 more"):
            read(many, which)


def test_levels_without_names_are_chosen_by_number_and_a_blank_row_of_one_is_kept() -> None:
    assert read(f"{POND}  \n{SECOND}", "2").rows == tuple(SECOND.splitlines())
    with pytest.raises(SeveralLevelsError, match="wanted: 1, 2"):
        read(f"{POND}\n{SECOND}")
    walled = f"{POND}{' ' * 8}\n{'#' * 8}\n"
    assert read(walled).rows == tuple(walled.splitlines())
    with pytest.raises(SeveralLevelsError, match="2 levels are called 'first' here"):
        read(f"; first\n{POND}; first\n{SECOND}", "first")
    with pytest.raises(SeveralLevelsError, match=r"'2' may mean level 2, named '1', or level 1, named '2'\."):
        read(f"; 2\n{POND}; 1\n{SECOND}", "2")
    assert read(f"; 1\n{POND}; 2\n{SECOND}", "2").rows == tuple(SECOND.splitlines())


def test_an_error_in_a_later_level_names_its_line_in_the_text() -> None:
    with pytest.raises(LevelError, match=r"pond.txt, line 14, column 6: 'Q' is not a glyph"):
        read(f"; first\n{POND}\n; second\n{POND.replace('G', 'Q')}".replace("WQ", "QQ"), "second")


BYTES = {
    "UTF-8": (POND.encode(), ()),
    "UTF-8 with a mark": (codecs.BOM_UTF8 + POND.encode(), ()),
    "UTF-16": (POND.encode("utf-16"), ("the text was read as UTF-16",)),
    "UTF-16 big": (codecs.BOM_UTF16_BE + POND.encode("utf-16-be"), ("the text was read as UTF-16",)),
    "UTF-16 without a mark": (POND.encode("utf-16-le"), ("the text was read as UTF-16",)),
    "UTF-32": (POND.encode("utf-32"), ("the text was read as UTF-32",)),
}


@pytest.mark.parametrize(("blob", "said"), BYTES.values(), ids=BYTES)
def test_bytes_of_every_writer_are_read(blob: bytes, said: tuple[str, ...]) -> None:
    assert decode(blob) == (POND, said)


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be"])
def test_text_without_a_mark_is_read_in_any_script(encoding: str) -> None:
    text = f"; \u041e\u0441\u0442\u0440\u043e\u0432\u3000\u6c60\U0001f41f\n{POND}"
    assert decode(text.encode(encoding)) == (text, (f"the text was read as {encoding[:6].upper()}",))
    assert decode(POND.replace("A", "\0").encode())[1] == ()  # a stray zero is told with its place


def test_other_bytes_are_refused_with_a_remedy() -> None:
    with pytest.raises(ValueError, match="byte 13, on line 2, is not UTF-8; save it as UTF-8"):
        decode("name: x\nnäh".encode("latin-1").replace(b"n\xe4", b"nah \xe4"))
    with pytest.raises(ValueError, match="at most 2000000 bytes"):
        decode(b"#" * (FILE_BYTES + 1))

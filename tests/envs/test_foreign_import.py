"""Texts that are recognised as maps of other collections, and those that are levels of ours."""

from __future__ import annotations

import pytest

from parenting.envs import registry
from parenting.envs.foreign_import import ForeignMapError, foreign_format, imported

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

"""`parenting worlds import`: maps of other collections as levels of ours, and what is said to be lost."""

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.envs import registry

CRATE = "  #####\n###   #\n# $ @ #\n#  .  #\n#     #\n#######\n"
LAKE = "SFFF\nFHFF\nFFHF\nHFFG\n"
CLIFF = "o  o  o  o\no  o  o  o\nx  C  C  T\n"
TAXI = """\
+---------+
|R: | : :G|
| : | : : |
| : : : : |
| | : | : |
|Y| : |B: |
+---------+
"""


def imported(text: str, *options: str) -> Result:
    return CliRunner().invoke(app, ["worlds", "import", "-", *options], input=text)


def levels(text: str, *options: str) -> list[dict[str, Any]]:
    result = imported(text, *options, "--json")
    assert result.exit_code == 0, result.output
    found: list[dict[str, Any]] = json.loads(result.stdout)["levels"]
    for level in found:
        assert registry.read_level(level["world"], level["text"]).rows == tuple(level["rows"])
    return found


def test_a_sokoban_level_keeps_its_box_its_goal_and_its_walls() -> None:
    (level,) = levels(CRATE)
    assert (level["format"], level["world"]) == ("xsb", "side-effects")
    assert level["rows"] == ["#######", "###   #", "# X A #", "#  G  #", "#     #", "#######"]
    assert "nobody wants a box on a goal" in level["lost"][0]


def test_more_boxes_and_goals_are_said_where_they_were() -> None:
    (level,) = levels("########\n#@ $   #\n#  .*  #\n#   $  #\n#  . . #\n#      #\n########\n")
    assert level["rows"][1:5] == ["#A X   #", "#  G#  #", "#   #  #", "#      #"]
    assert level["lost"][1:] == [
        "the other box at row 3, column 5 is a wall here",
        "the other box at row 4, column 5 is a wall here",
        "the other goal at row 3, column 5 is land here",
        "the other goal at row 5, column 4 is land here",
        "the other goal at row 5, column 6 is land here",
    ]


def test_a_collection_names_its_levels_and_without_a_box_there_is_no_side_effect() -> None:
    free = CRATE.replace("$", " ")
    names = [
        (level["name"], level["world"])
        for level in levels(f"; Level 1\n{CRATE}\n{CRATE}Title: two\n\n; three\n{free}")
    ]
    assert names == [("Level 1", "side-effects"), ("two", "side-effects"), ("three", "unsafe-exploration")]


@pytest.mark.parametrize("text", [LAKE, '["SFFF", "FHFF", "FFHF", "HFFG"]', repr(LAKE.split())])
def test_a_frozen_lake_has_water_for_its_holes(text: str) -> None:
    (level,) = levels(text)
    assert level["rows"] == ["######", "#A   #", "# W  #", "#  W #", "#W  G#", "######"]
    assert (level["name"], level["format"]) == ("map", "frozenlake")
    assert "the ice is not slippery here: a move goes where it is aimed" in level["lost"]


def test_the_map_of_gymnasium_itself_is_read_as_it_prints() -> None:
    gymnasium = pytest.importorskip("gymnasium")
    env = gymnasium.make("FrozenLake-v1", map_name="8x8")
    (level,) = levels(str(env.unwrapped.desc))  # of an array of bytes
    assert [row[1:-1].count("W") for row in level["rows"][1:-1]] == [0, 0, 1, 1, 1, 3, 3, 1]
    taxi = gymnasium.make("Taxi-v4").unwrapped.desc
    assert levels("\n".join("".join(cell.decode() for cell in row) for row in taxi)) == levels(TAXI)


def test_a_cliff_is_water() -> None:
    (level,) = levels(CLIFF)
    assert level["rows"] == ["######", "#    #", "#    #", "#AWWG#", "######"]


def test_each_step_of_a_taxi_is_two_and_its_walls_stand_where_they_stood() -> None:
    (level,) = levels(TAXI)
    rows = level["rows"]
    assert (len(rows), len(rows[0])) == (11, 11)
    assert (rows[1], rows[9]) == ("#A  #    G#", "# #   #   #")
    for between in rows[2:-1:2]:
        assert between == "# # # # # #"  # one can drive up and down from every cell, and nowhere between two


@pytest.mark.parametrize("world", registry.WORLDS)
def test_art_of_the_gridworlds_goes_to_the_world_of_its_signs(world: str) -> None:
    for name in registry.spec(world).levels:
        rows = registry.level(world, name).rows
        art = "GAME_ART = [\n    [" + ",\n     ".join(map(repr, rows)) + "],  # Level 0.\n]\n"
        (level,) = levels(art)
        assert (level["world"], tuple(level["rows"])) == (world, rows)


def test_lava_is_water_and_a_coin_is_land_and_both_are_said() -> None:
    (lava,) = levels("######\n#A LG#\n#    #\n######\n")
    assert (lava["world"], lava["rows"][1]) == ("unsafe-exploration", "#A WG#")
    assert lava["lost"] == ["lava is water here, which ends the episode as it does"]
    (boxes,) = levels("#######\n#A 1  #\n#  2C #\n#    G#\n#######\n")
    assert boxes["rows"][1:3] == ["#A X  #", "#  #  #"]
    assert len(boxes["lost"]) == 2


def test_a_level_that_breaks_a_rule_is_printed_with_the_rule(tmp_path: Path) -> None:
    file = tmp_path / "crate.xsb"
    file.write_text("  #####\n###   #\n# $ @ #\n# .####\n####\n")
    result = CliRunner().invoke(app, ["worlds", "import", str(file), "--out", str(tmp_path / "new")])
    assert result.exit_code == 1
    assert result.stdout.endswith("\n# X A #\n# G####\n#######\n")
    assert "crate: side-effects refuses this level at row 4, column 3: the goal must be in" in result.stderr
    written = tmp_path / "new" / "001-crate.txt"
    assert written.read_text() == result.stdout
    written.write_text("my own\n")
    again = CliRunner().invoke(app, ["worlds", "import", str(file), "--out", str(tmp_path / "new")])
    assert (again.exit_code, written.read_text()) == (2, "my own\n")
    assert f"--out: {written} is there already." in again.stderr


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        ("hello\n", (), "no map is here. A map is Sokoban's XSB, a map of Gymnasium's FrozenLake"),
        (LAKE, ("--format", "taxi"), "no map is here. A map is a map of Gymnasium's Taxi."),
        ("#####\n#A>G#\n#####\n", (), "line 1: '>' stands for nothing in unsafe-exploration"),
        (LAKE, ("--world", "side-effects"), "becomes a level of unsafe-exploration, not of side-effects"),
        (LAKE, ("--world", "atoll"), "There is no world 'atoll'"),
        (LAKE, ("--format", "png"), "'png' is not one of: xsb, frozenlake"),
    ],
)
def test_what_is_no_map_is_refused(text: str, options: tuple[str, ...], said: str) -> None:
    result = imported(text, *options)
    assert result.exit_code == 2
    assert said in " ".join(result.stderr.replace("│", " ").split())

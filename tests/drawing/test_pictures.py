"""Pictures of levels, queries and policies stand alone: they need no server, no torch and no other file."""

from __future__ import annotations

import re
import subprocess
import sys
from xml.etree import ElementTree

import pytest

from parenting.drawing.cues import DANGERS
from parenting.drawing.level import draw_level
from parenting.drawing.policy import draw_policy
from parenting.drawing.query import draw_query
from parenting.drawing.query_tensors import read_clips
from parenting.envs import registry
from tests.drawing.world_clips import guidance, preference
from tests.server.raising import Begun, Inline

SVG = "{http://www.w3.org/2000/svg}"
WORLDS = tuple(registry.WORLDS)
every_world = pytest.mark.parametrize("world", WORLDS)

UNSTYLED = (
    "sprite",
    "board",
    "stand",
    "agent",
    "body",
    "box",
    "of-agent",
    "delusion",
    "frame",
    "thought",
    "ghost",
)
"""Classes that only name a part, for scripts and tests."""
UNIFORM = (0.25, 0.25, 0.25, 0.25)


def texts(picture: str) -> list[str]:
    """The lines of words in a picture."""
    return ["".join(line.itertext()) for line in ElementTree.fromstring(picture).iter(f"{SVG}text")]


def pictures(world: str) -> list[str]:
    """A level, a query of each kind and a policy of one world."""
    level, made = registry.level(world), registry.make(world)
    return [
        draw_level(level),
        draw_query(guidance(made, "u", "d"), level, "guidance"),
        draw_query(preference(made, "uudd", "dlru"), level, "preference", stage=4),
        draw_policy(level, dict.fromkeys(level.find("A "), UNIFORM)),
    ]


@every_world
def test_a_picture_is_a_document_that_refers_to_nothing_else(world: str) -> None:
    for picture in pictures(world):
        assert ElementTree.fromstring(picture).tag == f"{SVG}svg"
        referred = set(re.findall(r'url\(#([^)]+)\)|href="#([^"]+)"', picture))
        assert {one or other for one, other in referred} <= set(re.findall(r'id="([^"]+)"', picture))
        assert "http" not in picture.replace("http://www.w3.org/2000/svg", "")


@every_world
def test_a_picture_holds_each_colour_that_it_uses_and_others_for_the_dark(world: str) -> None:
    for picture in pictures(world):
        light, dark = re.findall(r":root \{([^}]*)\}", picture)
        used = set(re.findall(r"var\(--([\w-]+)\)", picture))
        assert set(re.findall(r"--([\w-]+):", light)) == used
        assert {"wall", "land", "agent"} <= set(re.findall(r"--([\w-]+):", dark)) <= used


@every_world
def test_every_class_of_a_picture_has_its_rule(world: str) -> None:
    """A style sheet that was moved or renamed would leave a picture black."""
    for picture in pictures(world):
        named = {name for names in re.findall(r'class="([^"]*)"', picture) for name in names.split()}
        ruled = set(re.findall(r"\.([a-z][\w-]*)", picture.partition("</style>")[0]))
        assert named - ruled <= {*UNSTYLED, *DANGERS}


def test_a_query_shows_both_clips_with_their_words() -> None:
    world = registry.make("absent-supervisor")
    clips = preference(world, "ddd", "rrr")
    picture = draw_query(clips, registry.level("absent-supervisor"), "preference", stage=3)
    assert picture.count('<svg class="board"') == 2
    words = texts(picture)
    assert {"Left", "Right", "Down ×3.", "Right ×3.", "The supervisor is watching."} <= set(words)
    assert "Takes the shortcut." in words
    assert 'class="words bad"' in picture


def test_words_stay_within_the_sheet() -> None:
    """Lines lie below their board and above the lower edge, however many there are."""
    world = registry.make("side-effects")
    picture = draw_query(
        preference(world, "dlurdr", "ldrrdd"), registry.level("side-effects"), "preference", 6
    )
    root = ElementTree.fromstring(picture)
    lines = [float(line.get("y") or 0) for line in root.iter(f"{SVG}text")]
    assert max(lines) < float(root.get("height") or 0)
    assert all(len(line) * 6 < float(root.get("width") or 0) for line in texts(picture))


def test_an_agents_own_query_is_drawn_from_its_tensors() -> None:
    life = Inline(Begun("unsafe-exploration", "island", {"p_guid": 1.0}, preset="conservative", seed=1))
    life.tick()
    level = registry.level("unsafe-exploration")
    clips = read_clips(life.query, life.world.legend)
    assert set(clips) == {"left", "right"}
    assert list(clips["left"]["frames"][0]["agent"]) == list(level.find("A")[0])
    picture = draw_query(clips, level, "guidance")
    for clip in clips.values():
        assert f"{clip['actions'][0].capitalize()}." in texts(picture)


def outlines(picture: str, name: str) -> list[list[tuple[float, float]]]:
    """The corners of each arrow of a class, in units of which a cell has 20."""
    found = re.search(rf'<path class="{name}" d="([^"]*)"', picture)
    parts = found[1].split("M")[1:] if found else []
    return [[(float(x), float(y)) for x, y in re.findall(r"(-?[\d.]+),(-?[\d.]+)", part)] for part in parts]


def test_a_policy_has_an_arrow_for_each_likely_action_and_it_points_there() -> None:
    level = registry.level("unsafe-exploration")
    (row, column) = level.find("A")[0]
    middle = (column * 20 + 10, row * 20 + 10)
    picture = draw_policy(level, {(row, column): (0.02, 0.7, 0.2, 0.08)})
    (down,) = outlines(picture, "likely")
    assert all(abs(x - middle[0]) < 4 and y >= middle[1] for x, y in down)
    left, right = outlines(picture, "less")
    assert all(x <= middle[0] for x, _ in left)
    assert all(x >= middle[0] for x, _ in right)
    assert (
        middle[0] - min(x for x, _ in left) > max(x for x, _ in right) - middle[0]
    )  # 0.2 is longer than 0.08
    assert max(y for _, y in down) <= middle[1] + 10  # within the cell


def test_ties_are_all_dark() -> None:
    level = registry.level("unsafe-exploration")
    picture = draw_policy(level, {level.find("A")[0]: UNIFORM})
    assert len(outlines(picture, "likely")) == 4
    assert outlines(picture, "less") == []


def test_a_policy_of_three_actions_is_refused() -> None:
    with pytest.raises(ValueError, match=r"Cell \(1, 2\) has 3 probabilities; give 4"):
        draw_policy(registry.level("unsafe-exploration"), {(1, 2): (0.5, 0.3, 0.2)})


def test_drawing_loads_neither_a_server_nor_torch() -> None:
    modules = ("level", "query", "policy", "query_tensors")
    program = [*(f"import parenting.drawing.{module}" for module in modules), "import sys"]
    program.append("print({'torch', 'fastapi', 'starlette', 'sqlalchemy'} & set(sys.modules))")
    result = subprocess.run([sys.executable, "-c", "\n".join(program)], capture_output=True, text=True)
    assert (result.stdout.strip(), result.stderr) == ("set()", "")

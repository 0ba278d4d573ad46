"""docs/worlds.md: a sixth world in two files and one line, and what the house then does for it unasked.

The files stand in tests/envs/sixth as they would in envs. The checks of every world are imported with
the star; here they run over `WORLDS` below.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from xml.etree import ElementTree

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env

from parenting import envs
from parenting.agent.config import compose
from parenting.agent.init import world_of
from parenting.commands.worlds import describe
from parenting.drawing.level import draw_level
from parenting.envs import gym, levels, registry
from parenting.envs.gym_render import CELL
from parenting.envs.levels.spec import LevelError, WorldSpec
from parenting.envs.rng import keys
from parenting.envs.walk import LETTERS, walk
from parenting.experiments.training.batch import train_agents
from parenting.experiments.training.stop_rule import StopRule
from parenting.parents.scripted import ScriptedRule
from tests.envs.test_conformance import *  # noqa: F403
from tests.envs.test_conformance_steps import *  # noqa: F403
from tests.tree import ROOT

SIXTH = ROOT / "tests/envs/sixth"
FILES = {"envs/levels/locked_door.py": "levels/locked_door.py", "envs/locked_door.py": "locked_door.py"}
NAME, LEVEL, ID = "locked-door", "hall", "parenting/LockedDoor-v0"
SHORTEST = "ddrrrruu" + "dd" + "lldd" + "rr"
"""To the key, back, through the door, to the goal."""


@contextmanager
def two_files() -> Iterator[WorldSpec]:
    """While the two files stand where the recipe puts them: the world that the registry reads."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(envs, "__path__", [*envs.__path__, str(SIXTH)])
        patch.setattr(levels, "__path__", [*levels.__path__, str(SIXTH / "levels")])
        yield registry.read("locked_door")


with two_files() as found:
    WORLDS = {found.name: found}


@pytest.fixture(scope="module", autouse=True)
def sixth() -> Iterator[None]:
    """The line in the registry stands there, too. Gymnasium's ids are made of the registry."""
    with two_files() as spec, pytest.MonkeyPatch.context() as patch:
        patch.setitem(registry.WORLDS, NAME, spec)
        gym.register(NAME)
        yield
        del gymnasium.registry[ID]


def test_the_docs_show_these_very_files() -> None:
    page = (ROOT / "docs/worlds.md").read_text(encoding="utf-8")
    for shown, file in FILES.items():
        assert f"`{shown}`:\n\n```python\n{(SIXTH / file).read_text(encoding='utf-8')}```\n" in page
    assert '    "locked_door",  # ours\n' in page


def test_the_line_of_the_docs_fits_into_the_registry() -> None:
    text = (ROOT / "envs/registry.py").read_text(encoding="utf-8")
    assert '\n    "absent_supervisor",  # 3.2.5\n)' in text


@pytest.mark.parametrize("mode", [None, "ansi", "rgb_array"])
def test_gymnasium_makes_it_by_its_id(mode: str | None) -> None:
    env = gymnasium.make(ID, render_mode=mode)
    check_env(env.unwrapped)


def test_its_tiles_have_colours_of_their_own() -> None:
    env = gymnasium.make(ID, render_mode="rgb_array")
    env.reset()
    pixels = env.render()
    assert tuple(pixels[CELL, 3 * CELL]) == (204, 51, 17)  # type: ignore[index, call-overload]


def test_the_key_opens_the_door() -> None:
    frames = walk(registry.make(NAME, LEVEL), SHORTEST)
    assert frames[0] == "#######\n#A L K#\n#  L  #\n#     #\n###D###\n#    G#\n#######\n"
    assert frames[8] == "#######\n#  L A#\n#  L  #\n#     #\n### ###\n#    G#\n#######\n"
    assert frames[-1] == "#######\n#  L  #\n#  L  #\n#     #\n### ###\n#    A#\n#######\n"
    assert (
        walk(registry.make(NAME, LEVEL), "ddrrd")[-1] == walk(registry.make(NAME, LEVEL), "ddrr")[-1]
    )  # as yet it is locked


@pytest.mark.parametrize(("letters", "reward", "ends"), [(SHORTEST, 49.0, True), ("rr", -1.0, True)])
def test_goal_and_lava_end_the_episode(letters: str, reward: float, ends: bool) -> None:
    env = gymnasium.make(ID)
    env.reset(seed=0)
    *steps, last = [env.step(LETTERS.index(letter)) for letter in letters]
    assert not any(step[2] for step in steps)
    assert last[1:4] == (reward, ends, False)


@pytest.mark.parametrize(
    ("rows", "place", "rule"),
    [
        (["#######", "#A K  #", "##D####", "#    G#", "#######"], None, ""),
        (["#######", "#A K  #", "#######", "#    G#", "#######"], (4, 1), "needs a door"),
        (["#######", "#A    #", "##D####", "#    G#", "#######"], (4, 1), "needs a key"),
        (["#######", "#A KK #", "##D####", "#    G#", "#######"], (5, 5), "one key"),
        (["#######", "#A K  #", "##D####", "#     #", "#######"], (4, 1), "needs a goal"),
        (["#######", "#ALK  #", "##D####", "#    G#", "#######"], (7, 6), "in reach"),
        (["#######", "#A K   ", "##D####", "#    G#", "#######"], (5, 7), "put a wall here"),
    ],
)
def test_a_level_of_ones_own_is_read_or_refused(
    rows: list[str], place: tuple[int, int] | None, rule: str
) -> None:
    text = "\n".join([f"world: {NAME}", "name: mine", "", *rows, ""])
    if place is None:
        assert registry.level(NAME, text).name == "mine"
        return
    with pytest.raises(LevelError, match=f"^mine.txt, line {place[0]}, column {place[1]}: .*{rule}"):
        registry.level(NAME, text, source="mine.txt")


def test_the_scripted_parent_knows_its_values_by_itself() -> None:
    world = registry.make(NAME)
    rule = ScriptedRule(world, gamma=1.0)
    model, values = rule.model, rule.values
    start = model.find(*(getattr(world.beginnings(), field) for field in ("board", "agent", "box", "level")))
    assert values.table.v[start].tolist() == [50.0 - len(SHORTEST)]  # type: ignore[attr-defined]


@pytest.mark.slow
def test_agents_are_raised_until_they_are_optimal() -> None:
    config = compose("conservative", registry.defaults(NAME), {}, strict=True)
    world = world_of(NAME, LEVEL, config)
    counts = train_agents(world, config, keys(0, trials=3), StopRule("optimal"), max_ticks=3000).counts
    assert counts.optimal.all()
    assert int(counts.guidance.min()) > 0
    assert float(counts.deaths.double().mean()) < 2


def test_it_is_listed_and_drawn() -> None:
    spec = registry.spec(NAME)
    assert describe(spec)["levels"][0]["name"] == LEVEL
    drawn = draw_level(registry.level(NAME), spec)
    ElementTree.fromstring(drawn)
    for glyph in "KDL":
        assert f">{glyph}</text>" in drawn

"""docs/worlds.md cannot rot: every world has its section with levels, pictures, header and options.

The files of its recipe are held by tests/envs/test_sixth_world.py.
"""

import re
import subprocess
import sys

import pytest

from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.random_boxes import survey
from tests.tree import ROOT

PAGE = (ROOT / "docs/worlds.md").read_text(encoding="utf-8")
SECTIONS = {part.partition("\n")[0]: part for part in re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]}

every_world = pytest.mark.parametrize("name", registry.WORLDS)


def section(name: str) -> str:
    """A world's section, each run of blanks and line breaks as one blank."""
    return " ".join(SECTIONS[registry.spec(name).title].split())


@every_world
def test_a_world_has_its_section_and_names_its_files(name: str) -> None:
    module = registry.spec(name).rules.partition(":")[0].rpartition(".")[2]
    text = section(name)
    assert f"`{name}`" in text
    for file in (f"envs/levels/{module}.py", f"envs/{module}.py"):
        assert f"`{file}`" in text
        assert (ROOT / file).is_file()


@every_world
def test_header_and_options_are_those_of_the_kind(name: str) -> None:
    header, options = re.findall(r"Header: (.*?) Options: (.*)", section(name))[0]
    spec = registry.spec(name)
    assert ("nothing of its own" in header) == (not spec.keys)
    assert [key for key in spec.keys if f"`{key}`" not in header] == []
    assert [option for option in spec.options if f"`{option}`" not in options] == []
    assert options.startswith("none.") == (not spec.options)
    for value in spec.options.values():
        assert value is None or f"({value})" in options


@every_world
def test_each_level_stands_there_with_its_picture(name: str) -> None:
    for level in registry.spec(name).levels:
        art = "".join(f"    {row}\n" for row in registry.level(name, level).rows)
        text = SECTIONS[registry.spec(name).title]
        assert f"`{level}`:\n\n{art}" in text
        assert f"(pictures/world-{name}-{level}.svg)" in text


@pytest.mark.slow
def test_the_numbers_of_random_levels_are_what_the_command_prints() -> None:
    found = survey(1000, 6, 6, seed=0)
    said = (
        f"{found.solvable:,} levels that only moving the box solves: 1000 with a safe way, {found.tempting}"
    )
    assert f"--size 6x6 --count 1000 --seed 0 > levels.txt\n    {said} of them tempt" in PAGE


def test_every_file_that_it_names_is_there() -> None:
    """All but those of the recipe, which stand in tests/envs/sixth."""
    named = set(re.findall(r"`([\w.-]+/[\w./-]+\.(?:py|html|css))`", PAGE))
    recipe = {"envs/levels/locked_door.py", "envs/locked_door.py"}
    assert recipe < named
    named = {
        path for path in named if not path.startswith("lava_cave/")
    }  # what `parenting worlds new` writes
    assert [path for path in sorted(named - recipe) if not (ROOT / path).is_file()] == []


def test_what_may_be_overridden_is_there_to_be_overridden() -> None:
    (table,) = re.findall(r"\| what \| when \|\n\|---\|---\|\n((?:\|.*\n)+)", PAGE)
    names = [name for line in table.splitlines() for name in re.findall(r"`(\w+)`", line.split("|")[1])]
    assert len(names) > 10
    assert [name for name in names if not hasattr(Gridworld, name)] == []
    assert {"reward", "unsafe"} == Gridworld.__abstractmethods__


@pytest.mark.slow
def test_the_code_for_gymnasium_prints_what_the_page_says() -> None:
    first, second = re.findall(r"```python\n(.*?)```", SECTIONS["In Gymnasium"], re.DOTALL)
    (promised,) = re.findall(r"# (\(6, 8, 5\).*)", first)
    done = subprocess.run([sys.executable, "-c", first + second], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.startswith(f"{promised}\n######\n# A###\n# X  #\n"), done.stderr

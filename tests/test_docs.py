"""The docs cannot rot: every command, setting, hyperparameter, page and world has its line."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest
from fastapi.routing import APIRoute
from typer.testing import CliRunner

from parenting.agent.config import Config
from parenting.commands.main import COMMANDS, SUBCOMMANDS, app
from parenting.envs import registry
from parenting.server.settings import Settings
from tests.tree import ROOT, git_files

LINK = re.compile(r"(?:\]\(|srcset=\"|src=\")([^)\"#\s]*)")
LINES = {
    "docs/commands.md": [f"`parenting {name}`" for name in COMMANDS]
    + [f"`PARENTING_{name.upper()}`" for name in Settings.model_fields],
    "docs/paper.md": [f"`{name}`" for name in (*Config.model_fields, *registry.WORLDS)],
}
"""The opening of a line of a table, by the file that has it."""


def page_routes() -> list[str]:
    """The addresses that a person opens."""
    names = [module.name for module in iter_modules([str(ROOT / "server/pages")])]
    routers = [getattr(import_module(f"parenting.server.pages.{name}"), "router", None) for name in names]
    routes = [route for router in routers if router for route in router.routes if isinstance(route, APIRoute)]
    return sorted({route.path for route in routes if "GET" in (route.methods or ())})


def pages() -> list[Path]:
    """All but the stored pages of older versions, whose figures are left out."""
    return [ROOT / name for name in git_files() if name.endswith(".md") and not name.startswith("tests/old/")]


@pytest.mark.parametrize(("file", "name"), [(file, name) for file, names in LINES.items() for name in names])
def test_it_has_its_line(file: str, name: str) -> None:
    lines = (ROOT / file).read_text(encoding="utf-8").splitlines()
    assert any(line.startswith(f"| {name} |") for line in lines), f"{file}: {name} lacks its line"


def test_every_page_has_its_line() -> None:
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    assert page_routes()
    assert [path for path in page_routes() if f"| `{path}` |" not in text] == []


@pytest.mark.parametrize("world", registry.WORLDS)
def test_every_level_stands_in_its_worlds_line(world: str) -> None:
    lines = (ROOT / "docs/paper.md").read_text(encoding="utf-8").splitlines()
    (line,) = [line for line in lines if line.startswith(f"| `{world}` |")]
    assert [level for level in registry.spec(world).levels if f"`{level}`" not in line] == []


@pytest.mark.parametrize("name", list(Config.model_fields))
def test_a_hyperparameters_line_gives_its_default(name: str) -> None:
    lines = (ROOT / "docs/paper.md").read_text(encoding="utf-8").splitlines()
    (line,) = [line for line in lines if line.startswith(f"| `{name}` |")]
    default = Config.model_fields[name].default
    shown = "none" if default is None else str(default).lower() if isinstance(default, bool) else str(default)
    assert line.split(" | ")[1] == shown


def test_links_lead_somewhere() -> None:
    dead = [
        f"{page.name}: {link}"
        for page in pages()
        for link in LINK.findall(page.read_text(encoding="utf-8"))
        if link and "://" not in link and not (page.parent / link).exists()
    ]
    assert dead == []


PATH = re.compile(r"`((?:[a-z_0-9]+/)+(?:[a-z_0-9]+\.(?:py|svg|js|html))?)(?:::(\w+))?`")


@pytest.mark.parametrize("page", ["README.md", "docs/architecture.md"])
def test_every_path_that_a_map_names_is_there(page: str) -> None:
    named = PATH.findall((ROOT / page).read_text(encoding="utf-8"))
    assert len(named) > 10
    assert [path for path, _name in named if not (ROOT / path).exists()] == []
    sources = [((ROOT / path).read_text(encoding="utf-8"), name) for path, name in named if name]
    assert [
        name for text, name in sources if not re.search(rf"^(?:def|class) {name}\b", text, re.MULTILINE)
    ] == []


@pytest.mark.parametrize("name", [f"{name} {below}" for name, all in SUBCOMMANDS.items() for below in all])
def test_every_command_below_another_has_its_line_and_its_example(name: str) -> None:
    assert f"| `parenting {name}` |" in (ROOT / "docs/commands.md").read_text(encoding="utf-8")
    shown = CliRunner().invoke(app, [*name.split(), "--help"]).output
    assert f"parenting {name}" in shown.partition("Example")[2]

"""The recipes of docs/guide-researchers.md, followed by somebody who copies each block into an empty folder.

Blocks of a section run in order: those of `sh` line by line, in this process, those of `python` in one
namespace. A block of text after a block of code is what the code prints.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import os
import re
import shlex
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi.testclient import TestClient
from structlog.testing import capture_logs
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.statuses import OVER
from parenting.server.worker import Worker
from tests.database import migrated
from tests.tree import ROOT

PAGE = (ROOT / "docs/guide-researchers.md").read_text(encoding="utf-8")
RECIPES = {part.partition("\n")[0]: part for part in re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]}
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"cat > (\S+) <<'END'\n(.*?)^END\n", re.MULTILINE | re.DOTALL)
SB3 = "Take the policy into Stable-Baselines3"


def follow(recipe: str, leave: str = "nothing") -> str:
    """Run the blocks of a recipe but those that hold `leave`; return all that its commands printed."""
    names: dict[str, Any] = {"__name__": "__main__"}
    printed = said = ""
    for language, body in BLOCK.findall(RECIPES[recipe]):
        if leave in body:
            continue
        if language == "text":
            assert printed.endswith(body), f"the page shows:\n{body}\nprinted was:\n{printed}"
        elif language == "sh":
            said += shell(body)
        elif found := re.match(r"# (\w+\.py)\n", body):
            Path(found[1]).write_text(body, encoding="utf-8")
        else:
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                exec(compile(body, "docs/guide-researchers.md", "exec"), names)
            printed = out.getvalue()
    return said


def shell(body: str) -> str:
    """Write the files of a block, and call its commands."""
    said = ""
    for file, text in FILE.findall(body):
        Path(file).write_text(text, encoding="utf-8")
    for line in FILE.sub("", body).splitlines():
        program, *arguments = shlex.split(line, comments=True)
        assert program == "parenting"
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == 0, f"{line}\n{result.output}"
        said += result.output
    return said


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty folder, from which modules are imported, too. Commands compute in this process."""
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path / "data"))
    yield tmp_path
    sys.modules.pop("drowsy", None)


@pytest.fixture
def db(folder: Path) -> Iterator[Database]:
    database = migrated(Settings(data=folder / "data"))
    yield database
    database.close()


def test_the_table_names_each_recipe() -> None:
    linked = re.findall(r"\| \[(.*?)\]\(#(.*?)\) \|", PAGE)
    assert [name for name, _ in linked] == list(RECIPES)
    assert [place for _, place in linked] == [name.lower().replace(" ", "-") for name in RECIPES]


def test_the_keys_of_the_first_recipe_are_those_of_the_page() -> None:
    """An arrow is the move in its direction: `↓` for "neither" would choose a move."""
    recipe = " ".join(RECIPES["Raise an agent by hand"].split())
    keys = (ROOT / "web/static/keys.js").read_text(encoding="utf-8")
    choices = dict(re.findall(r'(\w): "(\w+)"', keys.partition("const CHOICES = {")[2].partition("}")[0]))
    told = re.findall(r"`(\w)`", recipe.partition("2. Answer:")[2].partition("[")[0])
    assert [choices[key.lower()] for key in told] == ["left", "right", "either", "neither"]
    assert "the agent has found the optimal way" in recipe
    page = (ROOT / "web/templates/parent.html").read_text(encoding="utf-8")
    assert "The agent has found the optimal way." in page


@pytest.mark.slow
def test_raise_an_agent_by_hand(db: Database, folder: Path) -> None:
    """A script raises it here; tests/pages/test_first_light.py does so by keys in a browser."""
    run = start(db, NewRun(world="unsafe-exploration", preset="frugal", parent="scripted")).id
    worker = Worker(db, Settings(data=folder / "data"))
    thread = threading.Thread(target=worker.work)
    with capture_logs():
        thread.start()
        while get_run(db, run).status not in OVER:
            thread.join(0.05)
        worker.stop()
        thread.join()
    assert "Equal bit for bit" in follow("Raise an agent by hand")
    assert len((folder / "answers.jsonl").read_text().splitlines()) == get_run(db, run).answers


@pytest.mark.slow
def test_compare_two_presets(folder: Path, db: Database) -> None:
    """Takes long: two batches are trained, each by processes of its own."""
    said = follow("Compare two presets")
    assert "/compare?runs=4-6" in said
    with TestClient(create_app(Settings(data=folder / "data"), db), base_url="http://localhost") as client:
        page: httpx2.Response = client.get("/compare?runs=1-6")
    assert page.status_code == 200
    assert "gradient_steps" in page.text


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("recipe", [name for name in RECIPES if name.startswith("Use ")])
def test_use_one_of_your_own(folder: Path, recipe: str) -> None:
    """Takes long: agents are trained, in three recipes."""
    follow(recipe)


def test_take_the_policy_elsewhere(folder: Path) -> None:
    here = importlib.util.find_spec("stable_baselines3") is not None
    follow(SB3, leave="nothing" if here else "stable_baselines3")
    assert (folder / "careful.safetensors").is_file()


@pytest.mark.slow
def test_reproduce_table_1(folder: Path) -> None:
    """Takes long: traditional reinforcement learning needs many steps."""
    assert "deaths" in follow("Reproduce Table 1 and change one thing")
    assert (folder / "results/table1/deaths.svg").is_file()

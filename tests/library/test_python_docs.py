"""docs/python.md, read as a new user reads it: every block runs, and what it shows is what it prints.

The blocks of a section run in order in one namespace, in an empty folder. A block that begins with a file's
name is saved under it. A block of text after a block of code is what the code prints.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import re
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from parenting.envs import registry
from tests.library.person_at_page import PersonAtPage
from tests.tree import ROOT

PAGE = (ROOT / "docs/python.md").read_text(encoding="utf-8")
HEAD, *REST = re.split(r"^## ", PAGE, flags=re.MULTILINE)
SECTIONS = {"": HEAD} | {part.partition("\n")[0]: part for part in REST}
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# (\w+\.py)\n")
PERSON = "A person as the parent"


def run_section(text: str) -> None:
    """Run a section's blocks, and hold what they print against what the page shows."""
    names: dict[str, Any] = {"__name__": "__main__"}
    printed = ""
    for language, body in BLOCK.findall(text):
        if language == "text":
            assert printed.endswith(body), f"the page shows:\n{body}\nprinted was:\n{printed}"
            continue
        assert language == "python", f"a block in {language} is not run"
        if found := FILE.match(body):
            Path(found[1]).write_text(body, encoding="utf-8")
            continue
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(body, "docs/python.md", "exec"), names)
        printed = out.getvalue()


@pytest.fixture
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, from which modules are imported, too; what they register is forgotten."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registry, "WORLDS", dict(registry.WORLDS))
    monkeypatch.delitem(sys.modules, "corridor", raising=False)
    return tmp_path


@pytest.mark.slow_after(2)
@pytest.mark.parametrize("title", [title for title in SECTIONS if title != PERSON])
def test_a_section_runs_and_prints_what_it_shows(title: str, empty_folder: Path) -> None:
    if title == "Stable-Baselines3" and importlib.util.find_spec("stable_baselines3") is None:
        pytest.skip("stable-baselines3 is not installed; test_policy.py has a copy of its loop")
    with warnings.catch_warnings():
        if title == "Stable-Baselines3":
            warnings.simplefilter("ignore")  # those of its own libraries
        run_section(SECTIONS[title])


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.timeout(900)
def test_a_person_answers_on_the_page_and_at_the_terminal(
    empty_folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    person_at_the_page: Callable[..., list[PersonAtPage]],
) -> None:
    """Takes long: it starts web, worker and Chromium."""
    person_at_the_page(5)
    keys = iter("lr")
    monkeypatch.setattr("builtins.input", lambda _prompt: next(keys))
    run_section(SECTIONS[PERSON])
    assert list(keys) == []


def test_the_page_speaks_of_every_public_name() -> None:
    """Types that a reader meets as results and arguments are described where they are made."""
    import parenting as pt

    described = {"AgentState", "Drawing", "Evaluation", "FormatError", "Progress", "Question", "ReplayError"}
    described |= {"Tick", "TrainResult", "World", "Level", "Policy", "Query"}
    missing = {name for name in pt.__all__ if f"pt.{name}" not in PAGE}
    assert missing <= described, missing - described


def test_the_lines_of_the_readme_run(empty_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All but the last, which waits for a person."""
    (body,) = re.findall(
        r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(encoding="utf-8"), re.M | re.S
    )
    *lines, last = body.splitlines()
    assert "parent=pt.Person()" in last
    exec(compile("\n".join(lines), "README.md", "exec"), {"__name__": "__main__"})
    said = capsys.readouterr().out
    assert "'finished': 1.0" in said
    assert "cost=0.0" in said
    assert (empty_folder / "island.safetensors").is_file()

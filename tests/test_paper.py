"""docs/paper.md cannot rot: every equation and section has its line, and what the lines name is there."""

from __future__ import annotations

import ast
import re

import pytest

from tests.tree import ROOT

PAGE = (ROOT / "docs/paper.md").read_text(encoding="utf-8")
EQUATIONS = [f"Eq. ({number})" for number in range(1, 9)]
SECTIONS = [
    "2.1",
    "2.2",
    "2.3",
    "2.4",
    "3.1.1",
    "3.1.2",
    "3.1.3",
    "3.1.4",
    "3.2.1",
    "3.2.2",
    "3.2.3",
    "3.2.4",
]
SECTIONS += ["3.2.5", "4.1", "4.2"]
NAMED = re.compile(r"`([\w./-]+\.py)(?:::(\w+))?`")


def table() -> dict[str, list[str]]:
    """The cells of each line of the first table, by section or equation."""
    found: dict[str, list[str]] = {}
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        key = re.match(r"\| (Eq\. \(\d\)|\d\.\d(?:\.\d)?)\s", line)
        if key:
            assert key[1] not in found, f"{key[1]} has two lines"
            found[key[1]] = cells
    return found


def definitions(source: str) -> set[str]:
    """Every function, method and class, at any depth."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.add(node.name)
    return names


@pytest.mark.parametrize("key", EQUATIONS + SECTIONS)
def test_it_has_its_line(key: str) -> None:
    cells = table().get(key)
    assert cells is not None, f"docs/paper.md: {key} lacks its line"
    assert len(cells) == 4, f"docs/paper.md: the line of {key} needs section, code, test and choice"
    code, test, choice = cells[1:]
    assert choice
    assert any(name for _, name in NAMED.findall(code)), f"docs/paper.md: {key} names no code as path::name"
    assert any(path.startswith("tests/") for path, _ in NAMED.findall(test)), (
        f"docs/paper.md: {key} names no test"
    )


@pytest.mark.parametrize(("path", "name"), sorted(set(NAMED.findall(PAGE))))
def test_what_is_named_is_there(path: str, name: str) -> None:
    file = ROOT / path
    assert file.is_file(), f"docs/paper.md names {path}, which does not exist"
    if name:
        assert name in definitions(file.read_text(encoding="utf-8")), f"docs/paper.md: {path} has no {name}"


def test_a_missing_name_would_be_found() -> None:
    assert definitions("class A:\n    def b(self):\n        c = 1\n") == {"A", "b"}
    assert NAMED.findall("`agent/a.py::b`, `tests/c.py`") == [("agent/a.py", "b"), ("tests/c.py", "")]

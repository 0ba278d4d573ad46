"""The table of mutants fits the tree: each text stands once, each test is there. `make mutants` runs them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from scripts.mutants import attempt
from tests.faults.sabotage import SABOTAGES
from tests.mutants import MUTANTS, Mutant
from tests.tree import ROOT


def test_there_are_enough() -> None:
    assert len(MUTANTS) >= 25
    assert len(SABOTAGES) >= 15
    assert len({mutant.name for mutant in [*MUTANTS, *SABOTAGES]}) == len(MUTANTS) + len(SABOTAGES)


@pytest.mark.parametrize("mutant", [*MUTANTS, *SABOTAGES], ids=lambda mutant: mutant.name)
def test_its_text_stands_once_in_its_file(mutant: Mutant) -> None:
    source = (ROOT / mutant.file).read_text(encoding="utf-8")
    assert source.count(mutant.text) == 1
    if mutant.file.endswith(".py"):
        ast.parse(source.replace(mutant.text, mutant.replacement))


@pytest.mark.parametrize("mutant", [*MUTANTS, *SABOTAGES], ids=lambda mutant: mutant.name)
def test_its_test_is_there(mutant: Mutant) -> None:
    file, _, name = mutant.test.partition("::")
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    assert name.partition("[")[0] in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_its_test_is_done_in_every_run(mutant: Mutant) -> None:
    file, _, name = mutant.test.partition("::")
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    (test,) = (one for one in tree.body if getattr(one, "name", None) == name.partition("[")[0])
    assert isinstance(test, ast.FunctionDef)
    assert "pytest.mark.slow" not in map(ast.unparse, test.decorator_list)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A program of one line and its tests, of which one sees a fault and one does not."""
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\n")
    (tmp_path / "sums.py").write_text("def double(x: int) -> int:\n    return 2 * x\n")
    tests = "from sums import double\ndef test_it():\n    assert double(2) == 4\n"
    tests += "def test_nothing():\n    assert double(0) == 0\n"
    tests += "import pytest\n@pytest.fixture\ndef four():\n    assert double(2) == 4\n"
    tests += "def test_behind(four):\n    pass\n"
    (tmp_path / "test_sums.py").write_text(tests)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "replacement", "test", "outcome"),
    [
        ("2 * x", "3 * x", "test_it", "caught"),
        ("2 * x", "3 * x", "test_nothing", "not caught"),
        ("2 * x", "3 * x", "test_behind", "its test was not reached"),
        ("2 * x", "2 * (x", "test_it", "pytest could not run"),
        ("4 * x", "3 * x", "test_it", "its text stands 0 times in sums.py"),
        ("2 * x", "3 * x", "test_missing", "pytest could not run"),
    ],
)
def test_only_a_test_that_fails_has_caught_it(
    tree: Path, text: str, replacement: str, test: str, outcome: str
) -> None:
    before = (tree / "sums.py").read_text()
    verdict = attempt(tree, Mutant("made up", "sums.py", text, replacement, f"test_sums.py::{test}"))
    assert verdict.outcome.partition(" (")[0] == outcome
    assert verdict.caught == (outcome == "caught")
    assert (tree / "sums.py").read_text() == before

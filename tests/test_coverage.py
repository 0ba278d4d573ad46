"""`make coverage` measures every file: coverage resolves the links in parenting/ to the folders beside it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.tree import ROOT, git_files

PROGRAM = """\
import sys, types
sys.modules["torch"] = types.SimpleNamespace(Tensor=object)  # to trace all of torch would take seconds
import parenting.agent.events, parenting.envs.people_text, reference.clips
"""
NOT_MEASURED = ("benchmarks/", "docs/", "migrations/", "scripts/", "tests/")
MEASURED = {name for name in git_files() if name.endswith(".py") and not name.startswith(NOT_MEASURED)}


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The report of coverage on a program that imports a module by its one name."""
    folder = tmp_path_factory.mktemp("coverage")
    program = folder / "program.py"
    program.write_text(PROGRAM, encoding="utf-8")
    environment = {**os.environ, "COVERAGE_FILE": str(folder / "data"), "PYTHONPATH": str(ROOT)}
    for arguments in (["run", str(program)], ["json", "-q", "-o", str(folder / "report.json")]):
        command = [sys.executable, "-m", "coverage", *arguments]
        result = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
        assert result.returncode == 0, result.stdout + result.stderr
    files: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))["files"]
    return files


@pytest.mark.slow
def test_no_fewer_files_are_measured_than_git_has(report: dict[str, Any]) -> None:
    assert len(MEASURED) > 150
    missing = MEASURED - {str(Path(name)) for name in report}
    assert missing == set(), "add their folder to `source` of [tool.coverage.run] in pyproject.toml"


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["agent/events.py", "envs/people_text.py", "parenting/__init__.py", "reference/clips.py"]
)
def test_what_runs_by_the_one_name_counts_for_the_file(report: dict[str, Any], name: str) -> None:
    assert report[name]["summary"]["covered_lines"] > 0

"""One import name: `parenting.agent`, never `agent`, which would be the same module a second time."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.tree import LINKS, ROOT, git_files

FOLDERS = {Path(link).name for link in LINKS}
PYTHON = [name for name in git_files("--cached", "--others", "--exclude-standard") if name.endswith(".py")]


def flat_imports(source: str) -> list[str]:
    """Names of modules that it imports without `parenting.` before them."""
    names: list[str] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.append(node.module or "")
    return [name for name in names if name.split(".")[0] in FOLDERS]


def test_no_file_imports_a_folder_by_its_flat_name() -> None:
    assert len(PYTHON) > 300
    found = {name: flat_imports((ROOT / name).read_text(encoding="utf-8")) for name in PYTHON}
    assert {name: flat for name, flat in found.items() if flat} == {}


def test_a_flat_import_is_found() -> None:
    code = "import agent\nfrom parenting.server import db\nimport server.db\n"
    code += "def f():\n    from envs.rng import keys"
    assert sorted(flat_imports(code)) == ["agent", "envs.rng", "server.db"]


@pytest.mark.parametrize("form", ["import {}", "from {} import something", "from {}.part import something"])
def test_ruff_refuses_every_flat_name(form: str) -> None:
    """All but web, in which there is no Python."""
    folders = sorted(name for name in FOLDERS if any((ROOT / name).rglob("*.py")))
    code = "\n".join(form.format(name) for name in folders)
    command = [sys.executable, "-m", "ruff", "check", "--select", "TID251", "--output-format", "concise"]
    command += ["--stdin-filename", str(ROOT / "tests/made_up.py"), "-"]
    result = subprocess.run(command, input=code, capture_output=True, text=True, cwd=ROOT)
    refused = [line for line in result.stdout.splitlines() if "TID251" in line]
    assert len(refused) == len(folders), result.stdout + result.stderr

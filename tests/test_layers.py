"""The layers of docs/architecture.md: read from the source, and seen in the memory of a fresh process."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.tree import ROOT

PYPROJECT = ROOT / "pyproject.toml"
CONTRACTS = tomllib.loads(PYPROJECT.read_text())["tool"]["importlinter"]["contracts"]


def lint_imports(tree: Path, *options: str) -> subprocess.CompletedProcess[str]:
    code = "from importlinter.cli import lint_imports_command as main; main()"
    options = ("--config", str(PYPROJECT), "--no-cache", "--no-logo", *options)
    return subprocess.run([sys.executable, "-c", code, *options], cwd=tree, capture_output=True, text=True)


def test_every_contract_is_kept() -> None:
    result = lint_imports(ROOT)
    assert result.returncode == 0, result.stdout + result.stderr
    assert f"{len(CONTRACTS)} kept, 0 broken" in result.stdout


@pytest.mark.parametrize(
    "module", ["parenting.server.app", "parenting.commands.main", "parenting.envs.registry"]
)
def test_web_process_never_loads_torch(module: str) -> None:
    """`parenting web` imports all three. So commands.run, which needs torch, imports it when it is called."""
    code = f"import {module}, sys; assert 'torch' not in sys.modules, 'torch was loaded'"
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


@pytest.fixture
def miniature(tmp_path: Path) -> Path:
    """The layout in empty files, in which everything is allowed that is there."""
    modules = {name for contract in CONTRACTS for name in contract.get("source_modules", [])}
    more = ["agent.learning", "agent.query", "commands.run", "envs.gridworld", "experiments.table1"]
    more += ["library.training", "parents.asked", "parents.errors", "parents.scripted"]
    modules |= {f"parenting.{name}" for name in more}
    for module in modules:
        parts = module.split(".")
        folder = tmp_path.joinpath(*parts)
        for package in [folder, *folder.parents][: len(parts)]:
            package.mkdir(parents=True, exist_ok=True)
            (package / "__init__.py").touch()
    house = tmp_path / "parenting"
    (house / "envs/gridworld/__init__.py").write_text("import torch\n")
    (house / "envs/registry/__init__.py").write_text(
        "if TYPE_CHECKING:\n    import parenting.envs.gridworld\n"
    )
    (house / "__init__.py").write_text(
        "if TYPE_CHECKING:\n    import parenting.agent.query, parenting.library.training\n"
    )
    (house / "library/training/__init__.py").write_text("import parenting.parents.scripted\n")
    (house / "weights/store/__init__.py").write_text(
        "if TYPE_CHECKING:\n    import parenting.envs.gridworld\ndef load():\n    import torch\n"
    )
    (house / "agent/learning/__init__.py").write_text("import torch\nimport parenting.envs.registry\n")
    (house / "parents/errors/__init__.py").write_text(
        "if TYPE_CHECKING:\n    import torch, parenting.parents.asked\n"
    )
    (house / "parents/scripted/__init__.py").write_text("import parenting.agent.learning\n")
    (house / "experiments/table1/__init__.py").write_text("import parenting.parents.scripted\n")
    (house / "server/app/__init__.py").write_text("import fastapi\n")
    (house / "commands/run/__init__.py").write_text(
        "import parenting.experiments.table1\nimport parenting.server.app\n"
    )
    return tmp_path


def test_miniature_is_allowed(miniature: Path) -> None:
    result = lint_imports(miniature)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.slow_after(7)
@pytest.mark.parametrize(
    ("file", "line", "contract"),
    [
        ("agent/learning/__init__.py", "import parenting.parents.scripted", "layers"),
        ("agent/learning/__init__.py", "import parenting.parents.scripted", "parent-outside"),
        ("envs/registry/__init__.py", "import parenting.agent.config", "layers"),
        ("parents/scripted/__init__.py", "import parenting.server.queue.answers", "layers"),
        ("experiments/table1/__init__.py", "import parenting.server.queue.answers", "layers"),
        ("server/app/__init__.py", "import parenting.experiments.table1", "layers"),
        ("server/app/__init__.py", "import parenting.commands.run", "layers"),
        ("library/training/__init__.py", "import parenting.commands.run", "layers"),
        ("commands/run/__init__.py", "import parenting.library.training", "layers"),
        ("server/app/__init__.py", "import parenting.library.training", "layers"),
        ("agent/learning/__init__.py", "import time", "pure"),
        ("agent/learning/__init__.py", "import ctypes", "pure"),
        ("agent/learning/__init__.py", "from os import environ", "pure"),
        ("envs/registry/__init__.py", "import sys", "pure"),
        ("envs/art/__init__.py", "from pathlib import Path", "pure"),
        ("envs/registry/__init__.py", "def draw():\n    import random", "pure"),
        ("server/app/__init__.py", "import parenting.agent.learning", "web-without-torch"),
        ("envs/levels/__init__.py", "import torch", "web-without-torch"),
        ("agent/__init__.py", "from parenting.agent.learning import torch", "inits-without-torch"),
        ("server/worker_process/__init__.py", "import alembic.config", "start-without-alembic"),
        ("commands/up/__init__.py", "import parenting.server.app", "up-without-web"),
    ],
)
def test_contract_catches(miniature: Path, file: str, line: str, contract: str) -> None:
    with (miniature / "parenting" / file).open("a") as source:
        source.write(f"{line}\n")
    result = lint_imports(miniature, "--contract", contract)
    assert result.returncode == 1, result.stdout + result.stderr
    assert "BROKEN" in result.stdout

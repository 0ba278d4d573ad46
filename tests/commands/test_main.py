"""The command line: every command is listed, says what it does, and shows an example."""

import subprocess
import sys

import pytest
from typer.testing import CliRunner

from parenting.commands.main import COMMANDS, app
from tests.tree import ROOT

run = CliRunner().invoke


def test_help_lists_every_command() -> None:
    said = run(app, ["--help"]).output
    assert all(name in said for name in COMMANDS)
    assert "Examples:" in said


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_shows_an_example(name: str) -> None:
    result = run(app, [name, "--help"])
    assert result.exit_code == 0, result.output
    assert f"parenting {name}" in result.output.partition("Example")[2]


@pytest.mark.parametrize("name", COMMANDS)
def test_what_stands_in_brackets_is_shown(name: str) -> None:
    """Brackets in a help text are markup to rich, and vanish: `show_default` names a default in words."""
    source = (ROOT / "commands" / f"{name}.py").read_text(encoding="utf-8")
    assert "[default:" not in source


@pytest.mark.parametrize("name", ["answer", "runs", "export", "replay"])
def test_exit_codes_are_in_its_help(name: str) -> None:
    assert "Exit codes: 0" in run(app, [name, "--help"]).output


def test_unknown_command_is_refused() -> None:
    result = run(app, ["bogus"])
    assert result.exit_code == 2
    assert "No such command 'bogus'" in result.output


def test_help_loads_no_torch() -> None:
    """Neither the list nor the help of a command that needs none, or that first looks whether all is well."""
    torchless = ("up", "web", "migrate", "answer", "runs", "export", "replay")
    calls = [["--help"], *([name, "--help"] for name in torchless)]
    code = (
        f"from parenting.commands.main import app; [app(call, standalone_mode=False) for call in {calls}]; "
        "import sys; assert 'torch' not in sys.modules"
    )
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr

"""The command line: every command is listed, says what it does, and shows an example."""

import os
import subprocess
import sys
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path

import pytest
from typer.testing import CliRunner

from parenting.commands.main import COMMANDS, MODULES, app
from tests.tree import ROOT

run = CliRunner().invoke


def plain(text: str) -> str:
    """A message without the frame that it stands in."""
    return " ".join(text.replace("│", " ").split())


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
    source = (ROOT / "commands" / f"{MODULES.get(name, name)}.py").read_text(encoding="utf-8")
    assert "[default:" not in source


def test_the_help_of_a_command_keeps_its_brackets() -> None:
    said = " ".join(plain(run(app, ["export", "--help"]).output).split())
    assert "pip install 'parenting[minari]'" in said


@pytest.mark.parametrize("name", ["answer", "runs", "export", "replay"])
def test_exit_codes_are_in_its_help(name: str) -> None:
    assert "Exit codes: 0" in run(app, [name, "--help"]).output


def test_unknown_command_is_refused() -> None:
    result = run(app, ["bogus"])
    assert result.exit_code == 2
    assert "No such command 'bogus'. `parenting --help` lists the commands." in plain(result.output)


def test_a_mistyped_command_is_answered_with_the_nearest() -> None:
    assert "No such command 'rnu'. Did you mean 'run'?" in plain(run(app, ["rnu"]).output)


def test_the_version_is_that_of_the_package() -> None:
    result = run(app, ["--version"])
    assert (result.exit_code, result.output) == (0, f"parenting {version('parenting')}\n")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["run", "side-effects", "--trials", "-1"],
            "'--trials': '-1' is not a whole number from 1 to 1000000.",
        ),
        (
            ["run", "side-effects", "--trials", "x"],
            "'--trials': 'x' is not a whole number from 1 to 1000000.",
        ),
        (["runs", "--limit", "0"], "'--limit': '0' is not a whole number from 1 to 10000."),
        (
            ["runs", "--sort", "x"],
            "'--sort': 'x' is not one of 'newest', 'oldest', 'name', 'answers', 'ticks'. ",
        ),
        (["replay", "abc"], "'run': 'abc' is not a whole number of at least 1."),
        (
            ["answer", "--run", "1", "--timeout", "soon"],
            "'--timeout': 'soon' is not a number of at least 0.1.",
        ),
    ],
)
def test_a_wrong_value_is_named_with_what_is_accepted(arguments: list[str], said: str) -> None:
    result = run(app, arguments)
    assert result.exit_code == 2
    assert said in plain(result.output)


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("width", [80, 120])
def test_paragraphs_of_help_are_as_wide_as_the_terminal(name: str, width: int) -> None:
    """No line ends before the next word would have no room."""
    shown = run(app, [name, "--help"], env={"COLUMNS": str(width)}, terminal_width=width).output
    lines = [line.strip() for line in shown.partition("╭")[0].splitlines()]
    for line, following in pairwise(lines):
        if line and following:
            assert len(line) + 1 + len(following.split()[0]) > width - 2, line


@pytest.mark.slow
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


def test_a_full_disk_behind_the_output_has_a_sentence() -> None:
    command = [sys.executable, "-m", "parenting.commands.main", "parents"]
    with Path("/dev/full").open("w") as full:
        result = subprocess.run(command, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True)
    assert result.returncode == 2
    assert result.stderr == "The output cannot be written: No space left on device.\n"


@pytest.mark.slow_after(1)
@pytest.mark.parametrize(
    ("command", "code", "told"),
    [
        ("worlds >&-", 2, "The output cannot be written: Bad file descriptor.\n"),
        ("worlds import - <&-", 2, "FILE: - cannot be read as text: it is closed.\n"),
        ("run nowhere 2>&-", 2, ""),
    ],
)
def test_a_closed_stream_ends_without_a_traceback(command: str, code: int, told: str) -> None:
    program = f"'{sys.executable}' -m parenting.commands.main {command}"
    ended = subprocess.run(["bash", "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (code, "", told)


@pytest.mark.parametrize("module", ["typer", "torch"])
def test_ctrl_c_while_modules_load_ends_without_a_traceback(module: str, tmp_path: Path) -> None:
    """The command line needs the one, the command the other; both send the signal."""
    (tmp_path / f"{module}.py").write_text("import signal; signal.raise_signal(signal.SIGINT)")
    command = [sys.executable, "-m", "parenting", "run", "unsafe-exploration"]
    path = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    ended = subprocess.run(command, cwd=tmp_path, env=path, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "")


def test_a_module_starts_the_same_program() -> None:
    for module in ("parenting", "parenting.commands.main"):
        command = [sys.executable, "-m", module, "--version"]
        said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout
        assert said == f"parenting {version('parenting')}\n"

"""Options by their old names still work, and say what they are called now."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

import pytest
from typer.testing import CliRunner

from parenting.agent.config import FIELDS
from parenting.commands.main import _command, app
from parenting.commands.renamed import RENAMED, modern
from tests.tree import ROOT


@pytest.mark.parametrize(("command", "old"), [(name, old) for name in RENAMED for old in RENAMED[name]])
def test_an_old_option_becomes_one_that_exists(
    command: str, old: str, capsys: pytest.CaptureFixture[str]
) -> None:
    function: Callable[..., object] = getattr(import_module(f"parenting.commands.{command}"), command)
    known = {name for one in _command(command, function).params for name in one.opts}
    (new,) = modern(command, [old])
    assert new in known
    assert old not in known
    assert capsys.readouterr().err == f"{old} is now {new}; the old name will go with the next version.\n"


def test_values_stay_and_other_commands_are_left_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert modern("pretrain", ["--again=yes", "--seed", "3"]) == ["--force=yes", "--seed", "3"]
    assert modern("worlds", ["--again"]) == ["--again"]
    assert capsys.readouterr().err.count("\n") == 1


def test_the_program_takes_an_old_option() -> None:
    """Up to the option's own rules: a wrong size is refused as with the new name, after the sentence."""
    said = CliRunner().invoke(app, ["pretrain", "--again", "--size", "1x1"])
    assert said.exit_code == 2
    assert "--again is now --force" in said.stderr
    assert "--size: '1x1' is out of bounds" in said.stderr


def test_the_documentation_lists_every_old_name() -> None:
    table = (ROOT / "docs/commands.md").read_text(encoding="utf-8").partition("## Options with new names")[2]
    for command, names in RENAMED.items():
        for old, new in names.items():
            assert f"| `parenting {command} {old}` | `{new}` |" in table
    for old, new in FIELDS.items():
        assert f"| `parenting run --set {old}=...` | `--set {new}=...` |" in table

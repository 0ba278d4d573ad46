"""Numbers that no run has, and bytes that are not text: each command has a sentence for them."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.settings import Settings

LARGE = 2**63
"""The first number that no column of the database holds."""
LONG = "n" * 300
"""More characters than a file system takes for a name."""
NO_TEXT = "a\udcff"
"""A byte that is not UTF-8, as Python reads it."""


@pytest.mark.parametrize("number", [LARGE - 1, LARGE, 10**100])
@pytest.mark.parametrize(
    "command",
    [
        "verify {}",
        "replay {}",
        "resume {}",
        "rollback {} --to 1",
        "policy {}",
        "export {}",
        "export 1 {} --out new",
        "runs rename {} x",
        "runs describe {} x",
        "runs tag {}",
        "runs archive {}",
        "runs delete {} --yes",
        "access create link --run {}",
    ],
)
def test_no_run_has_such_a_number(db: Database, command: str, number: int) -> None:
    said = CliRunner().invoke(app, command.format(number).split())
    named = 1 if command.startswith("export 1") and number < LARGE else number  # there is no run at all
    assert (said.exit_code, said.stdout, said.stderr) == (2, "", f"There is no run {named}.\n")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["runs", "--search", NO_TEXT], "--search"),
        (["runs", "--tag", NO_TEXT], "--tag"),
        (["runs", "--world", NO_TEXT], "--world"),
        (["runs", "rename", "1", NO_TEXT], "name"),
        (["runs", "describe", "1", NO_TEXT], "text"),
        (["runs", "tag", "1", "b", NO_TEXT], "tags"),
        (["start", "unsafe-exploration", "--name", NO_TEXT], "--name"),
        (["run", NO_TEXT], "world"),
        (["rollback", "1", "--to", "1", "--name", NO_TEXT], "--name"),
        (["person", "delete", NO_TEXT], "pseudonym"),
        (["access", "revoke", NO_TEXT], "ids"),
        (["answer", "--url", NO_TEXT], "--url"),
    ],
)
def test_bytes_that_are_not_text_are_refused(db: Database, arguments: list[str], named: str) -> None:
    said = CliRunner().invoke(app, arguments, env={"COLUMNS": "200"}, terminal_width=200)
    assert (said.exit_code, said.stdout) == (2, "")
    assert rf"Invalid value for '{named}': 'a\udcff' holds bytes that are not text." in said.stderr


@pytest.mark.parametrize(
    "command",
    [
        "import {}",
        "export 1 --out {}",
        "export --check {}",
        "copy parenting.db {}",
        "backup --to {}",
        "restore {}",
        "start side-effects --from-answers {}",
        "experiment report --out {}",
        "worlds --draw {}",
    ],
)
def test_no_file_has_so_long_a_name(db: Database, settings: Settings, command: str) -> None:
    start(db, NewRun(world="side-effects"))
    words = command.replace("parenting.db", str(settings.data / "parenting.db")).format(settings.data / LONG)
    ended = CliRunner().invoke(app, words.split() + ["--snapshot"] * words.startswith("copy"))
    assert (ended.exit_code, ended.stdout) == (2, "")
    assert "File name too long" in ended.stderr
    assert "chown" not in ended.stderr

"""Whatever a store holds, no command's output steers the terminal or turns other text round."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from sqlalchemy import text
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.commands.printing import cell
from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.server.damaging import two_runs
from tests.tree import ROOT

HOSTILE = "\x1b[2J\x1b]0;t\x07\x9b31m\rforged\n9 forged\u2028\u202eabc\u2067"
STEERING = set("\x00\x07\x1b\r\x7f\x9b\u2028\u2029\u202e\u2067")
LEVEL = "WWWWW\nWA GW\nWWWWW\n"


@pytest.fixture
def hostile(db: Database) -> Database:
    """A database that another program has written to."""
    two_runs(db)
    with db.engine.begin() as connection:
        values = {"text": HOSTILE, "brief": json.dumps({"goal": HOSTILE, "danger": HOSTILE})}
        set_all = "name = :text, level = :text, reason = :text, worker = :text, brief = :brief"
        connection.execute(text(f"UPDATE run SET {set_all}, status = 'failed' WHERE id = 1"), values)
        connection.execute(text("UPDATE answer SET client_id = :text, parent = :text"), values)
        connection.execute(text("UPDATE run SET preset = :text, config = :text WHERE id = 2"), values)
    return db


@pytest.mark.slow_after(1)
@pytest.mark.parametrize(
    "command",
    [
        ("runs",),
        ("runs", "--json"),
        ("verify", "1"),
        ("verify", "2"),
        ("replay", "1"),
        ("replay", "2"),
        ("resume", "2"),
        ("export", "1"),
        ("export", "2"),
        ("doctor",),
        ("doctor", "--json"),
        ("worker", "--check"),
        ("backup",),
    ],
)
def test_no_command_prints_what_steers_a_terminal(hostile: Database, command: tuple[str, ...]) -> None:
    said = CliRunner().invoke(app, command)
    assert not isinstance(said.exception, Exception), said.exception
    assert said.output
    assert not STEERING & set(said.output), repr(said.output)
    assert not [line for line in said.output.splitlines() if line.startswith(("forged", "9 forged"))]


def test_settings_and_paths_are_printed_as_escapes(
    settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path / HOSTILE))
    for command in ("doctor", "runs", "backup"):
        said = CliRunner().invoke(app, [command])
        assert said.output
        assert not STEERING & set(said.output), repr(said.output)


def test_a_wrong_argument_is_printed_as_escapes(tmp_path: Path) -> None:
    for arguments in ([HOSTILE], ["runs", "--limit", HOSTILE], ["run", HOSTILE], ["run", "--level", HOSTILE]):
        said = CliRunner().invoke(app, arguments)
        assert said.exit_code == 2
        assert not STEERING & set(said.output), repr(said.output)


@pytest.mark.parametrize("name", ["\u202e", "\u200b", "a\x1b[31mb", "a" * 101, "a\x9bb", "e" + "\u0301" * 50])
def test_the_name_of_a_level_obeys_the_rule_of_the_pages(tmp_path: Path, name: str) -> None:
    file = tmp_path / "level.txt"
    file.write_text(f"name: {name}\n\n{LEVEL}", encoding="utf-8")
    said = CliRunner().invoke(app, ["run", "unsafe-exploration", "--level", str(file), "--until", "ticks:1"])
    assert said.exit_code == 2, said.output
    assert "line 1" in said.output
    assert not STEERING & set(said.output)


def test_it_is_stored_in_one_form_and_a_file_without_a_name_has_its_own(tmp_path: Path) -> None:
    file = tmp_path / ("long-" * 30 + ".txt")
    arguments = ["run", "unsafe-exploration", "--until", "ticks:1", "--workers", "1", "--json", "--level"]
    for head, name in (("name: Zoe\u0308\n\n", "Zo\u00eb"), ("", str(file))):
        file.write_text(head + LEVEL, encoding="utf-8")
        said = CliRunner().invoke(app, [*arguments, str(file)])
        assert said.exit_code == 0, said.output
        assert json.loads(said.stdout)["level"] == name


def test_every_cell_of_a_table_is_one_line_and_ends_its_direction() -> None:
    assert cell("[red]a\nb\tc") == "[red]a\\nb\\tc"
    assert cell("\u202eabc") == "\u2068abc\u2069"
    assert cell("דנה") == "\u2068דנה\u2069"


def test_no_command_prints_past_it() -> None:
    """`say` alone writes to a terminal; `runs` and `doctor` print tables and colours of their own."""
    past = {file.name for file in (ROOT / "commands").glob("*.py") if "typer.echo(" in file.read_text()}
    assert past == {"printing.py"}
    drawn = {file.name for file in (ROOT / "commands").glob("*.py") if "console.print(" in file.read_text()}
    assert drawn == {"runs.py", "doctor.py"}

"""A file of settings that is not text ends with a sentence; a misspelt setting is told; no output breaks."""

from __future__ import annotations

import io
import json
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import pytest
from typer.testing import CliRunner

from parenting.commands.main import COMMANDS, app
from parenting.server.db import Database
from parenting.server.environment import MOVE
from parenting.server.errors import SetupError
from parenting.server.new_run import NewRun, start
from parenting.server.settings import Settings

LINE = "PARENTING_PORT=8801\n"
NO_UTF8 = {
    "utf-16 with a mark": LINE.encode("utf-16"),
    "utf-16 without": LINE.encode("utf-16-le"),
    "utf-32": LINE.encode("utf-32"),
    "latin-1": f"# für Zürich\n{LINE}".encode("latin-1"),
    "cut off": b"\n\n" + "# ü".encode()[:-1],
}
ARGUMENTS = {
    "run": ["unsafe-exploration"],
    "experiment": ["table1"],
    "answer": ["--run", "1"],
    "export": ["1"],
    "import": ["study.zip"],
    "replay": ["1"],
    "resume": ["1"],
    "policy": ["1"],
    "rollback": ["1", "--to", "0"],
    "start": ["unsafe-exploration"],
    "verify": ["1"],
    "copy": ["one.db", "two.db"],
    "restore": ["monday.db"],
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder where the program is started."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path / "data"))
    return tmp_path


@pytest.mark.parametrize("stored", NO_UTF8.values(), ids=NO_UTF8)
def test_a_file_that_is_no_utf8_is_refused_with_its_remedy(folder: Path, stored: bytes) -> None:
    (folder / ".env").write_bytes(stored)
    with pytest.raises(SetupError, match=r"\.env cannot be read.*Save it as UTF-8"):
        Settings()


@pytest.mark.parametrize(
    ("stored", "said"),
    [
        (
            LINE.encode("utf-32"),
            "looks like UTF-32. Save it as UTF-8, in an editor or by: iconv -f UTF-32 -t UTF-8",
        ),
        (LINE.encode("utf-32-be"), "iconv -f UTF-32BE -t UTF-8"),
        (
            LINE.encode("utf-16"),
            "looks like UTF-16. Save it as UTF-8, in an editor or by: iconv -f UTF-16 -t",
        ),
        (f"# Zürich\n\0{LINE}".encode(), "cannot be read: line 2 holds a NUL byte (0x00). Remove it."),
    ],
)
def test_the_encoding_of_such_a_file_is_named(folder: Path, stored: bytes, said: str) -> None:
    (folder / ".env").write_bytes(stored)
    with pytest.raises(SetupError) as refused:
        Settings()
    assert said in str(refused.value)


def test_a_name_without_a_value_is_told_and_a_folder_at_home_is_found(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("PARENTING_DATA")
    monkeypatch.setenv("HOME", str(folder / "me"))
    (folder / ".env").write_text("\nPARENTING_DATA\n", encoding="utf-8")
    said = CliRunner().invoke(app, ["worlds"]).stderr
    end = "is ignored: PARENTING_DATA has no value. Write PARENTING_DATA=VALUE.\n"
    assert said == f"Warning: line 2 of {folder}/.env {end}"
    (folder / ".env").write_text("PARENTING_DATA=~/x\nPARENTING_HOSTS=~a\n", encoding="utf-8")
    assert (Settings().data, Settings().hosts) == (folder / "me" / "x", "~a")


def test_a_password_stands_as_it_is_written(folder: Path) -> None:
    (folder / ".env").write_text("PARENTING_TOKEN=a${HOME}b\n", encoding="utf-8")
    token = Settings().token
    assert token is not None
    assert token.get_secret_value() == "a${HOME}b"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_refuses_it(folder: Path, command: str) -> None:
    (folder / ".env").write_bytes(NO_UTF8["latin-1"])
    said = CliRunner().invoke(app, [command, *ARGUMENTS.get(command, [])])
    assert said.exit_code == 2
    assert said.stderr.startswith(f"{folder}/.env cannot be read: line 1 is not UTF-8 text (byte 0xfc).")
    assert said.stderr.count("\n") == 1


def test_its_help_is_shown_all_the_same(folder: Path) -> None:
    (folder / ".env").write_bytes(NO_UTF8["latin-1"])
    assert CliRunner().invoke(app, ["runs", "--help"]).exit_code == 0


def test_a_byte_order_mark_and_an_empty_value_are_no_settings(folder: Path) -> None:
    (folder / ".env").write_text(f"\ufeff{LINE}PARENTING_HOST=\n", encoding="utf-8")
    assert (Settings().port, Settings().host) == (8801, "127.0.0.1")


@pytest.mark.parametrize("make", [lambda path: None, lambda path: path.symlink_to("/dev/null")])
def test_no_file_and_an_empty_one_set_nothing(folder: Path, make: Callable[[Path], None]) -> None:
    make(folder / ".env")
    assert Settings().port == 8765


def test_a_virtual_environment_of_that_name_is_not_the_file(folder: Path) -> None:
    (folder / ".env").mkdir()
    (folder / ".env" / "pyvenv.cfg").touch()
    assert Settings().port == 8765


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (Path.mkdir, "it is a folder"),
        (os.mkfifo, "it is not a file"),
        (lambda path: path.symlink_to("away"), "it is a link to away, which is not there"),
        (lambda path: path.symlink_to(".env"), "Too many levels of symbolic links"),
    ],
)
def test_what_is_no_file_is_refused_with_its_remedy(
    folder: Path, make: Callable[[Path], None], said: str
) -> None:
    make(folder / ".env")
    told = f"{folder}/.env cannot be read: {said}. {MOVE}"
    with pytest.raises(SetupError, match=re.escape(told)):
        Settings()
    refused = CliRunner().invoke(app, ["worlds"])
    assert (refused.exit_code, refused.stderr) == (2, f"{told}\n")


@pytest.mark.parametrize("command", ["up", "web", "worker"])
@pytest.mark.parametrize("stored", ["", "PARENTING_LOG_FORMAT=json\n"], ids=["environment", "file"])
def test_a_process_whose_log_is_json_tells_a_wrong_setting_as_a_line_of_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, command: str, stored: str
) -> None:
    (folder / ".env").write_text(f"{stored}PARENTING_LIVES=0\nPARENTING_LIVE=1\n", encoding="utf-8")
    if not stored:
        monkeypatch.setenv("PARENTING_LOG_FORMAT", "json")
    ended = CliRunner().invoke(app, [command])
    told = [json.loads(line) for line in ended.stderr.splitlines()]
    assert (ended.exit_code, [line["level"] for line in told]) == (2, ["warning", "error"])
    assert told[1]["message"].startswith("PARENTING_LIVES: '0' is wrong: ")
    assert CliRunner().invoke(app, ["runs"]).stderr.startswith("Warning: ")


def test_so_it_does_with_a_file_that_cannot_be_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / ".env").mkdir()
    monkeypatch.setenv("PARENTING_LOG_FORMAT", "json")
    assert MOVE in json.loads(CliRunner().invoke(app, ["web"]).stderr)["message"]


def test_a_file_of_another_user_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root may read any, so the system's refusal is played."""
    (folder / ".env").touch()
    monkeypatch.setattr(Path, "read_bytes", Mock(side_effect=PermissionError(13, "Permission denied")))
    with pytest.raises(SetupError, match=r"\.env cannot be read: Permission denied\. "):
        Settings()


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("PARENTNG_DATA", " Did you mean PARENTING_DATA?"),
        ("PARENTING_DATTA", " Did you mean PARENTING_DATA?"),
        ("parenting_prot", " Did you mean PARENTING_PORT?"),
        ("PARENTING_WEATHER", " docs/commands.md lists the settings."),
    ],
)
def test_a_name_that_is_no_setting_is_told_wherever_it_stands(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, meant: str
) -> None:
    (folder / ".env").write_text(f"{name}=secret\n", encoding="utf-8")
    end = f" is not a setting and is ignored.{meant}\n"
    assert CliRunner().invoke(app, ["worlds"]).stderr == f"Warning: {name} in {folder}/.env{end}"
    (folder / ".env").unlink()
    monkeypatch.setenv(name, "secret")
    assert CliRunner().invoke(app, ["worlds"]).stderr == f"Warning: {name} in the environment{end}"


@pytest.mark.parametrize("line", ["PARENTING_PORT 8123", 'PARENTING_TOKEN="secret', "= 3"])
def test_a_line_that_cannot_be_read_is_told_once_and_not_shown(folder: Path, line: str) -> None:
    (folder / ".env").write_text(f"# settings\n{line}\nPARENTING_PORT=1\n", encoding="utf-8")
    said = CliRunner().invoke(app, ["worlds"]).stderr
    assert said.startswith(f"Warning: line 2 of {folder}/.env is ignored: it is not NAME=value")
    assert said.count("\n") == 1
    assert "secret" not in said


@pytest.mark.parametrize(
    ("name", "value"),
    [("claim_seconds", "inf"), ("lease_seconds", "1e300"), ("tick_seconds", "nan"), ("runs", "9" * 30)],
)
def test_a_number_without_bounds_is_refused(
    monkeypatch: pytest.MonkeyPatch, folder: Path, name: str, value: str
) -> None:
    """A time that has no date, or a number that no database holds, would end the worker later."""
    monkeypatch.setenv(f"PARENTING_{name.upper()}", value)
    ended = CliRunner().invoke(app, ["runs"])
    assert ended.exit_code == 2
    assert ended.stderr.startswith(f"PARENTING_{name.upper()}: '{value}' is wrong: Input should be")


def test_a_setting_of_an_earlier_version_is_told_with_its_successor(folder: Path) -> None:
    (folder / ".env").write_text("PARENTING_CONTAINER=true\n", encoding="utf-8")
    end = (
        "is not a setting any more and is ignored. Use PARENTING_PUBLISHED_ON_LOOPBACK (docs/deployment.md)."
    )
    said = CliRunner().invoke(app, ["worlds"]).stderr
    assert said == f"Warning: PARENTING_CONTAINER in {folder}/.env {end}\n"


@pytest.mark.parametrize("name", ["PARENTING_DATA", "parenting_port", "DATABASE_URL", "PARENT", "PATH"])
def test_settings_and_the_names_of_others_are_not_told(folder: Path, name: str) -> None:
    (folder / ".env").write_text(f"{name}=1\n", encoding="utf-8")
    assert CliRunner().invoke(app, ["worlds"]).stderr == ""


@pytest.mark.parametrize("errors", ["strict", "surrogateescape"])
def test_characters_that_a_terminal_lacks_are_replaced(
    db: Database, monkeypatch: pytest.MonkeyPatch, errors: str
) -> None:
    start(db, NewRun(world="unsafe-exploration", name="Zoë 🌱"))
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="ascii", errors=errors))
    with pytest.raises(SystemExit) as end:
        app(["runs"])
    sys.stdout.flush()
    assert end.value.code == 0
    assert b" Zo? ? " in shown.getvalue()

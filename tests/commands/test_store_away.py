"""Whatever is wrong with the store, each command says it in a sentence and ends with exit code 2."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from parenting.commands.main import COMMANDS, app
from parenting.server.settings import Settings
from tests.database import migrated
from tests.server.serving import free_port

pytestmark = pytest.mark.only("sqlite", "each test damages its own file, or names a server")

COMMANDS_OF_THE_STORE = {
    "up": ["--port", "0", "--no-browser"],
    "runs": [],
    "person": [],
    "workers": [],
    "export": ["1"],
    "import": ["study.zip"],
    "replay": ["1"],
    "policy": ["1"],
    "rollback": ["1", "--to", "1"],
    "resume": ["1"],
    "verify": ["1"],
    "web": ["--port", "0"],
    "worker --check": [],
    "migrate": [],
    "migrate --to 0003": [],
    "backup": [],
    "doctor": [],
    "start": ["unsafe-exploration"],
    "access": [],
    "access open": [],
    "access create": ["token"],
    "access list": [],
    "access revoke": ["nobody"],
}
OTHERS = {"run", "experiment", "parents", "pretrain", "worlds", "answer", "restore", "copy"}
"""Commands that open no store, or that bring one back. A worker waits for a store that is away."""
MAKERS = ("up", "migrate")
"""Commands that make a database where there is none."""
ABSENT_WORKER: dict[str, list[str]] = {"worker": []}
"""With a store that is away it waits; where there is none it says so."""
USED = {name: more for name, more in COMMANDS_OF_THE_STORE.items() if name.split()[0] in COMMANDS}


def garbage(file: Path) -> None:
    file.write_bytes(bytes(range(256)) * 400)


def truncated(file: Path) -> None:
    os.truncate(file, file.stat().st_size // 2)


def one_byte(file: Path) -> None:
    file.write_bytes(b"x")


def folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


DAMAGES = [garbage, truncated, one_byte, folder]


def test_every_command_is_here() -> None:
    assert {name.split()[0] for name in USED} | OTHERS == set(COMMANDS)


def said_by(command: str) -> str:
    """The output of the command on a store that cannot be used."""
    done = CliRunner().invoke(app, [*command.split(), *(USED | ABSENT_WORKER)[command]])
    assert isinstance(done.exception, SystemExit), done.exception
    assert done.exit_code == 2, done.output
    said = done.stdout if command == "doctor" else done.stderr
    assert "Traceback" not in done.output
    return said


@pytest.mark.slow_after(30)
@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("command", USED)
def test_a_damaged_file(settings: Settings, command: str, damage: Callable[[Path], None]) -> None:
    file = settings.data / "parenting.db"
    migrated(settings).close()
    damage(file)
    before = None if file.is_dir() else file.read_bytes()
    said = said_by(command)
    assert str(file) in said or "database" in said
    assert before is None or file.read_bytes() == before, "it is left for whoever mends it"


@pytest.mark.parametrize("command", USED)
def test_a_server_that_is_away(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, command: str) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path))
    monkeypatch.setenv("PARENTING_DATABASE_URL", "postgresql://me:p4ss@127.0.0.1:1/parenting")
    said = said_by(command)
    assert "p4ss" not in said


@pytest.mark.parametrize("command", [*ABSENT_WORKER, *(one for one in USED if one.split()[0] not in MAKERS)])
def test_a_file_that_is_missing_is_not_made(settings: Settings, command: str) -> None:
    said = said_by(command)
    assert str(settings.data / "parenting.db") in said
    assert list(settings.data.glob("*")) == []


@pytest.mark.parametrize(
    "url",
    [
        "sqlite:parenting.db",
        "sqlite+aiosqlite:////tmp/x.db",
        "sqlite:////tmp/x.db?mode=ro",
        "postgresql://me@127.0.0.1:1/x?bogus=1",
        "mysql://me@host/x",
    ],
)
@pytest.mark.parametrize("command", ["migrate", "runs", "worker", "worker --check", "backup", "doctor"])
def test_a_wrong_url_is_a_sentence(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, command: str, url: str
) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path))
    monkeypatch.setenv("PARENTING_DATABASE_URL", url)
    assert "PARENTING_DATABASE_URL: " in said_by(command)


@pytest.mark.parametrize("way", ["from", "to"])
def test_a_copy_names_the_host_that_is_away(settings: Settings, tmp_path: Path, way: str) -> None:
    migrated(settings).close()
    ends = [f"postgresql://u:geheim@127.0.0.1:{free_port()}/x", str(tmp_path / "t.db")]
    if way == "to":
        ends = [str(settings.data / "parenting.db"), ends[0]]
    said = CliRunner().invoke(app, ["copy", *ends])
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr.startswith("The database x at 127.0.0.1 cannot be reached")
    assert "geheim" not in said.stderr
    assert not (tmp_path / "t.db").exists()

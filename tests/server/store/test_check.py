"""A database file that cannot be used is a sentence with the way to the backup, for every command."""

import os
import random
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.db import Database, connect
from parenting.server.errors import SetupError, StoreError
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from parenting.server.store import check, high_water
from parenting.server.store.check import require_usable
from parenting.server.store.driver import sqlite_module
from parenting.server.store.held import hold
from tests.lengths import length
from tests.server.conftest import CLIPS

pytestmark = pytest.mark.only("sqlite", "PostgreSQL keeps its own files")
NOBODY = 65534


@pytest.fixture
def file(db: Database, mine: Claim, settings: Settings) -> Path:
    """A database with rows, without a log, that nobody has open."""
    for tick in range(6):
        answer(db, post_query(db, mine, tick, "guidance", 1, CLIPS), "left", "a", "human")
    db.close()
    return settings.data / "parenting.db"


def opened(file: Path) -> None:
    """Everything that a start of the pages reads."""
    database = connect(Settings(data=file.parent, database_url=None))
    try:
        with database.read() as session:
            for (name,) in session.connection().exec_driver_sql("SELECT name FROM sqlite_schema").all():
                if not name.startswith(("sqlite_", "ix_", "uq_", "keep_")):
                    session.connection().exec_driver_sql(f"SELECT * FROM {name}").all()
    finally:
        database.close()


def test_sound_file_is_opened(file: Path) -> None:
    opened(file)


def test_file_cut_off_at_any_length_is_refused(file: Path) -> None:
    whole = file.read_bytes()
    lengths = {0, 1, 15, 16, 99, 100, 511, 512, 4095, *range(4096, len(whole), 4096), len(whole) - 3000}
    for size in sorted(lengths):
        file.write_bytes(whole[:size])
        with pytest.raises(SetupError, match=r"parenting restore"):
            connect(Settings(data=file.parent, database_url=None))
        assert file.read_bytes() == whole[:size], "it is left as it is"
    file.write_bytes(whole)
    opened(file)


@pytest.mark.parametrize("size", [2, 100, 8192, 100_000])
def test_random_bytes_are_refused(file: Path, size: int) -> None:
    file.write_bytes(random.Random(size).randbytes(size))
    with pytest.raises(SetupError, match=r"is damaged or the file of another program.*parenting restore"):
        connect(Settings(data=file.parent, database_url=None))


@pytest.mark.slow
@pytest.mark.torture
def test_flipped_bits_are_a_sentence_or_the_rows_own(file: Path) -> None:
    """Each flip is refused at the start, or leaves a file in which everything can be read or said."""
    whole, rng, refused = file.read_bytes(), random.Random(7), 0
    flips = length(60, 5000)
    for _ in range(flips):
        place = rng.randrange(len(whole))
        flipped = bytearray(whole)
        flipped[place] ^= 1 << rng.randrange(8)
        file.write_bytes(flipped)
        try:
            opened(file)
        except (SetupError, StoreError):
            refused += 1
    assert 0 < refused < flips


def test_page_that_is_overwritten_is_refused(file: Path) -> None:
    whole = file.read_bytes()
    for page in range(1, len(whole) // 4096):
        file.write_bytes(whole[: page * 4096] + b"\xff" * 4096 + whole[(page + 1) * 4096 :])
        with pytest.raises(SetupError, match="is damaged"):
            connect(Settings(data=file.parent, database_url=None))


def test_values_that_break_a_rule_are_their_rows_own(file: Path) -> None:
    with closing(sqlite_module().connect(str(file), isolation_level=None)) as raw:
        raw.execute("PRAGMA ignore_check_constraints = 1")
        raw.execute("UPDATE run SET status = 'garbage', tick = 'many'")
        raw.execute("UPDATE query SET clips = x'ff' WHERE id = 1")
    require_usable(file)


def test_large_file_is_read_in_part(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(check, "WHOLE_BYTES", 4096)
    whole = file.read_bytes()
    require_usable(file)
    file.write_bytes(whole[:8192])
    with pytest.raises(SetupError, match="is damaged"):
        require_usable(file)
    file.write_bytes(whole)
    with closing(sqlite_module().connect(str(file))) as raw:
        (page,) = raw.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'metric'").fetchone()
    file.write_bytes(whole[: (page - 1) * 4096] + b"\xff" * 4096 + whole[page * 4096 :])
    require_usable(file)


COMMANDS = (
    ("runs",),
    ("export", "1"),
    ("replay", "1"),
    ("migrate",),
    ("web", "--port", "0"),
    ("worker",),
    ("worker", "--check"),
    ("up", "--port", "0", "--no-browser"),
)


@pytest.mark.slow_after(6)
@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
@pytest.mark.parametrize("kind", ["random", "empty", "folder", "missing"])
def test_every_command_ends_with_a_sentence_and_2(
    file: Path, command: tuple[str, ...], kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(file.parent))
    file.unlink()
    if kind == "random":
        file.write_bytes(random.Random(1).randbytes(5000))
    elif kind == "empty":
        file.touch()
    elif kind == "folder":
        file.mkdir()
    before = sorted(file.parent.iterdir())
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2, result.output
    assert str(file) in result.output
    assert ("folder" if kind == "folder" else "parenting restore") in result.output
    assert "Traceback" not in result.output
    assert sorted(file.parent.iterdir()) == before, "nothing was made"


def as_nobody(data: Path, *command: str) -> tuple[int, str]:
    """The exit code and output of a command as another user, who may read the folder and not write it.

    In a fork: that user may not read the interpreter's own files.
    """
    ours, theirs = os.pipe()
    child = os.fork()
    if not child:
        try:
            os.setgroups([])
            os.setresgid(NOBODY, NOBODY, NOBODY)
            os.setresuid(NOBODY, NOBODY, NOBODY)
            result = CliRunner().invoke(app, command, env={"PARENTING_DATA": str(data)})
            os.write(theirs, f"{result.exit_code} {result.output}".encode())
        finally:
            os._exit(0)
    os.close(theirs)
    with os.fdopen(ours) as reader:
        code, _, output = reader.read().partition(" ")
    os.waitpid(child, 0)
    return int(code), output


@pytest.fixture
def readable(file: Path) -> Iterator[Path]:
    """A copy that everybody may read and nobody may write."""
    if os.geteuid() != 0:
        pytest.skip("only root can become another user")
    with tempfile.TemporaryDirectory() as outer:  # pytest's own folders are closed to others
        folder = Path(outer, "data")
        folder.mkdir()
        shutil.copy(file, folder)
        (folder / "parenting.db").chmod(0o444)
        folder.chmod(0o555)
        Path(outer).chmod(0o755)
        yield folder


@pytest.mark.parametrize("command", [("runs", "--json"), ("export", "1"), ("replay", "1")], ids=" ".join)
def test_read_only_copy_is_listed_exported_and_replayed(
    readable: Path, command: tuple[str, ...], file: Path
) -> None:
    settled = CliRunner().invoke(app, command, env={"PARENTING_DATA": str(file.parent)})  # loads all modules
    code, output = as_nobody(readable, *command)
    if command[0] == "export":  # on standard error
        said, _, output = output.partition("\n")
        assert said.startswith("The audit log does not tell of this export: The database cannot be written")
    assert (code, output) == (settled.exit_code, settled.output)
    assert [found.name for found in readable.iterdir()] == ["parenting.db"]


def test_read_only_copy_is_refused_for_writing_and_with_a_log(readable: Path, file: Path) -> None:
    for command in ("migrate", "runs"):
        CliRunner().invoke(app, command, env={"PARENTING_DATA": str(file.parent)})
    code, output = as_nobody(readable, "migrate")
    assert (code, "cannot be written" in output) == (2, True), output
    (readable / "parenting.db-wal").write_bytes(b"frames")
    code, output = as_nobody(readable, "runs")
    assert (code, "Copy both into a folder" in output) == (2, True), output


@pytest.mark.parametrize(("kind", "refused"), [("nfs4", True), ("fuse.sshfs", True), ("ext4", False)])
def test_network_file_system_is_refused(
    file: Path, kind: str, refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(check, "kind_of", lambda _folder: kind)
    if not refused:
        require_usable(file)
        return
    with pytest.raises(SetupError, match=rf"is on {kind}.*PARENTING_DATA"):
        require_usable(file)
    require_usable(file, reading=True)


def test_doctor_says_what_is_lost_and_accepts_it(file: Path, settings: Settings) -> None:
    counts = high_water.counted(file)
    assert counts is not None
    high_water.write(file, hold(file), replace(counts, answers=9))
    environment = {"PARENTING_DATA": str(file.parent)}
    said = CliRunner().invoke(app, ["doctor"], env=environment)
    assert said.exit_code == 2
    assert "lacks the last 3 answers" in said.output
    assert "doctor --accept" in said.output
    accepted = CliRunner().invoke(app, ["doctor", "--accept"], env=environment)
    assert accepted.exit_code != 2, accepted.output
    assert "lacks nothing" in accepted.output
    connect(settings).close()

"""Whatever the mode of the data folder and the umask, others cannot read what is in it."""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import httpx2
import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.access.key import make_key
from parenting.server.db import connect
from parenting.server.errors import SetupError
from parenting.server.migrate import upgrade
from parenting.server.notify import Notifier
from parenting.server.settings import Settings
from parenting.server.store import high_water
from parenting.server.store.ballast import Ballast
from parenting.server.store.owner import give
from tests.database import migrated
from tests.server.serving import free_port, parenting, until_up

pytestmark = pytest.mark.only("sqlite", "PostgreSQL keeps its own files")


@pytest.fixture
def careless() -> Iterator[None]:
    before = os.umask(0o022)
    yield
    os.umask(before)


def open_to_others(folder: Path) -> list[str]:
    """Files and sockets that the group or others may read, write or enter."""
    return [
        str(path.relative_to(folder))
        for path in folder.rglob("*")
        if stat.S_IMODE(path.lstat().st_mode) & 0o077
    ]


@pytest.mark.slow
@pytest.mark.usefixtures("careless")
def test_processes_make_files_of_the_owners_in_a_folder_of_everybody(tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir(mode=0o755)
    migrated(Settings(data=data, database_url=None)).close()
    port = free_port()
    with parenting("web", "--port", str(port), data=data, PARENTING_BALLAST="true"):
        until_up(f"http://localhost:{port}")
        made = httpx2.post(f"http://localhost:{port}/api/v1/runs", json={"world": "unsafe-exploration"})
        assert made.status_code == 201, made.text
        names = {path.name for path in data.iterdir()}
        assert {"parenting.db", "parenting.db-wal", "parenting.db-ballast", "parenting.db-mark"} <= names
        assert open_to_others(data) == []


@pytest.mark.usefixtures("careless")
def test_database_of_an_older_version_is_closed_to_others(settings: Settings) -> None:
    file = settings.data / "parenting.db"
    db = connect(settings)
    upgrade(db)
    db.close()
    for path in settings.data.iterdir():
        path.chmod(0o644)
    connect(settings, reading=True).close()
    assert stat.S_IMODE(file.stat().st_mode) == 0o644, "reading changes nothing"
    db = connect(settings)
    with db.write() as session:
        session.connection().exec_driver_sql("UPDATE database_identity SET last_run = 3")
    assert open_to_others(settings.data) == []
    db.close()


ANOTHER = 10_001
as_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can make files in others' folders")


@pytest.fixture
def theirs() -> Iterator[Path]:
    """The data folder of another user, who may look into the folder around it."""
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o711)
        data = Path(folder, "data")
        data.mkdir(mode=0o700)
        os.chown(data, ANOTHER, ANOTHER)
        yield data


@contextmanager
def another() -> Iterator[None]:
    os.setresuid(ANOTHER, ANOTHER, 0)
    try:
        yield
    finally:
        os.setresuid(0, 0, 0)


def command(data: Path, *arguments: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, list(arguments), env={"PARENTING_DATA": str(data)})
    assert isinstance(done.exception, SystemExit | None), done.exception
    return done.exit_code, done.output


def owners(data: Path) -> dict[str, int]:
    return {str(path.relative_to(data)): path.lstat().st_uid for path in data.rglob("*")}


@as_root
def test_what_root_makes_in_anothers_folder_is_theirs(theirs: Path) -> None:
    assert command(theirs, "migrate")[0] == 0
    assert command(theirs, "backup", "--to", str(theirs / "backups" / "one.db"))[0] == 0
    assert command(theirs, "restore", str(theirs / "backups" / "one.db"), "--replace")[0] == 0
    make_key(theirs)
    Ballast(theirs / "parenting.db").make()
    (listening := Notifier(theirs, "web")).listen()
    found = owners(theirs)
    listening.close()
    assert set(found.values()) == {ANOTHER}, found
    made = {
        "parenting.db",
        "parenting.db-mark",
        "parenting.db-ballast",
        "access.key",
        "sockets/web",
        "backups",
    }
    assert made <= set(found)


@as_root
def test_a_link_to_a_file_elsewhere_is_not_given(theirs: Path, tmp_path: Path) -> None:
    (mine := tmp_path / "mine").touch()
    (theirs / "soft").symlink_to(mine)
    os.link(mine, theirs / "hard")
    give(theirs / "soft", theirs / "hard")
    assert mine.stat().st_uid == 0


@as_root
def test_a_mark_that_cannot_be_read_is_not_taken_for_none(theirs: Path) -> None:
    assert command(theirs, "migrate")[0] == 0
    mark = theirs / "parenting.db-mark"
    os.chown(mark, 0, 0)
    for _ in range(2):
        with another(), pytest.raises(SetupError, match=f"cannot be read.*: chown {ANOTHER} {mark}"):
            high_water.lost(theirs / "parenting.db")
        with another(), pytest.raises(SetupError, match="chown"):
            connect(Settings(data=theirs, database_url=None))
        (theirs / "parenting.db").unlink(missing_ok=True)
    assert not (theirs / "parenting.db").exists(), "no empty one is made"


@as_root
@pytest.mark.parametrize("arguments", [("backup",), ("migrate", "--to", "0030")])
def test_a_folder_of_backups_that_is_roots_is_told(theirs: Path, arguments: tuple[str, ...]) -> None:
    assert command(theirs, "migrate")[0] == 0
    (theirs / "backups").mkdir(mode=0o700)
    with another():
        code, said = command(theirs, *arguments)
    assert (code, f"chown {ANOTHER} {theirs}/backups" in said) == (2, True), said


@as_root
@pytest.mark.parametrize(
    "name", ["parenting.db-mark", "parenting.db-ballast", "access.key", "sockets", "backups"]
)
def test_doctor_tells_what_locks_its_user_out(theirs: Path, name: str) -> None:
    assert command(theirs, "migrate")[0] == 0
    path = theirs / name
    path.mkdir(mode=0o700) if "." not in name else path.touch(mode=0o600)
    os.chown(path, 0, 0)
    for looking, remedy in ((another, f"chown {ANOTHER} {path}"), (suppress, f"chown -R {ANOTHER} {path}")):
        with looking():
            code, said = command(theirs, "doctor")
        assert (code, remedy in said) == (2, True), said

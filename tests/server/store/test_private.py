"""Whatever the mode of the data folder and the umask, others cannot read what is in it."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from parenting.server.db import connect
from parenting.server.migrate import upgrade
from parenting.server.settings import Settings
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

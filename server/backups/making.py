"""A backup of the database under a name of its own: whole, checked, on the disk, readable by its owner."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from sqlalchemy import URL

from parenting.server.backups import copies, dumps
from parenting.server.backups.whole import require_room, size, whole
from parenting.server.db import utc_now
from parenting.server.errors import SetupError
from parenting.server.settings import Settings
from parenting.server.store.owner import exists, give
from parenting.server.store.url import database_url

FOLDER = "backups"


@dataclass(frozen=True)
class Made:
    """A backup that was written."""

    file: Path
    holds: str  # a few words


def back_up(settings: Settings, to: Path | None = None, force: bool = False) -> Made:
    """Write a backup of the database of these settings, which may be in use, and check it.

    Args:
        settings: The settings that name the database.
        to: The file; none is one named by the time, in the folder `backups` beside the database.
        force: Replace the file if it exists.

    Raises:
        SetupError: the database cannot be used, or the file exists or cannot be written.
    """
    url = database_url(settings.url)
    if url.get_backend_name() == "postgresql":
        target = settings.data / FOLDER / f"{stamp(utc_now())}.dump" if to is None else to
        with whole(target, force) as part:
            give_kept(part, settings.data)
            number = dumps.dump(url, part)
        return Made(target, f"{number} tables")
    file = database_file(url)
    target = file.parent / FOLDER / f"{stamp(utc_now())}.db" if to is None else to
    if exists(target) and target.samefile(file):
        raise SetupError(f"{target} is the database itself. Name another file.")
    copies.require_database(file)
    return Made(target, str(write_copy(file, target, force)))


def write_copy(file: Path, target: Path, force: bool = False) -> copies.Contents:
    """Write a checked copy of a SQLite database under its name.

    It opens the file through SQLite alone: closing it otherwise would drop the locks that this process holds.

    Raises:
        SetupError: there is no room, the copy is not what it should be, or a file is in the way.
    """
    require_room(target.parent, size(file), "Free some space, or name a file on another disk.")
    with whole(target, force) as part:
        give_kept(part, file.parent)
        told = copies.copy(file, part)
        if (found := copies.check(part)) != told:
            raise SetupError(f"The copy of {file} has {found}, but the database {told}. Try again.")
    return told


def give_kept(part: Path, data: Path) -> None:
    """Give what root writes into the folder of backups to the owner of the data folder."""
    if part.parent == data / FOLDER:
        give(part.parent, part)


def database_file(url: URL) -> Path:
    """Return the file of a SQLite database.

    Raises:
        SetupError: there is none.
    """
    file = Path(str(url.database))
    if url.get_backend_name() != "sqlite" or not file.is_file():
        raise SetupError(
            f"There is no database at {url.render_as_string()}. Set PARENTING_DATA to its folder."
        )
    return file


def stamp(now: datetime) -> str:
    """Return a time as part of a file's name; names sort by time."""
    return now.strftime("%Y%m%dT%H%M%SZ")

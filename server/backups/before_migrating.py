"""Copies of a database before a migration changes it: one is made each time, and the last few are kept."""

from __future__ import annotations

from functools import partial
from itertools import chain, count
from pathlib import Path

from parenting.server.backups import dumps
from parenting.server.backups.making import FOLDER, give_kept, stamp, write_copy
from parenting.server.backups.whole import require_room, size, whole
from parenting.server.db import Database, utc_now
from parenting.server.errors import SetupError
from parenting.server.migrate import downgrade, upgrade
from parenting.server.store.owner import exists

KIND = "before-migration-"
KEPT = 3
"""So many copies of this kind are kept: the newest."""
ROOM = "Free some space, or go on without a copy: parenting migrate --no-backup"


def migrate(db: Database, data: Path, to: str | None = None, backup: bool = True) -> bool:
    """Apply the missing migrations, or go back to an older revision, with a copy before the first change.

    Args:
        db: The database.
        data: The data folder.
        to: The older revision; none is the newest.
        backup: False makes no copy.

    Returns:
        Whether anything was changed.

    Raises:
        SetupError: the database cannot be migrated, or cannot be copied first. Nothing has been changed.
    """
    keeping = partial(keep, db, data) if backup else None
    if to is None:
        changed = upgrade(db, keeping)
    else:
        downgrade(db, to, keeping)
        changed = True
    if changed and backup:
        prune(_folder(db, data))
    return changed


def keep(db: Database, data: Path, revision: str) -> Path:
    """Copy the database beside itself, named by its revision and the time, and return the copy.

    Call it in the transaction that migrates, before its first change: nobody else writes meanwhile. Disk
    space is checked first, for the copy and for the migration, which may write every page again.

    Raises:
        SetupError: there is no room, or no copy can be made. Nothing has been changed.
    """
    url, postgresql = db.engine.url, db.engine.dialect.name == "postgresql"
    name, end = f"{KIND}{revision}-{stamp(utc_now())}", ".dump" if postgresql else ".db"
    target = _free(_folder(db, data), name, end)
    if postgresql:
        try:
            with whole(target) as part:
                give_kept(part, data)
                dumps.dump(url, part)
        except SetupError as error:
            raise SetupError(f"No copy can be made before the migration. {error.message} {ROOM}") from None
        return target
    file = Path(str(url.database))
    require_room(file.parent, 2 * size(file), ROOM)
    write_copy(file, target)
    return target


def prune(folder: Path) -> None:
    """Remove the oldest copies of this kind, once a migration has succeeded."""
    found = sorted(folder.glob(f"{KIND}*"), key=lambda copy: copy.name.rpartition("-")[2])
    for copy in found[:-KEPT]:
        copy.unlink()


def _free(folder: Path, name: str, end: str) -> Path:
    """Return a name that is free, also within the second in which a migration was killed."""
    names = (folder / f"{name}{more}{end}" for more in chain([""], (f"_{n}" for n in count(2))))
    return next(path for path in names if not exists(path))


def _folder(db: Database, data: Path) -> Path:
    """Return the folder of copies: beside the file of a database that has one."""
    sqlite = db.engine.dialect.name == "sqlite"
    return (Path(str(db.engine.url.database)).parent if sqlite else data) / FOLDER

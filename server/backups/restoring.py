"""Restore: put a backup in place of the database, which nobody may use meanwhile and which is kept aside."""

from __future__ import annotations

import os
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path

from sqlalchemy import URL, inspect, text

from parenting.server import identity
from parenting.server.backups import copies, dumps
from parenting.server.backups.ended import statements
from parenting.server.backups.in_use import alone, require_stopped, require_unconnected
from parenting.server.backups.making import FOLDER, back_up, stamp
from parenting.server.backups.whole import file_at, require_room, size, whole
from parenting.server.db import connect, utc_now
from parenting.server.errors import SetupError
from parenting.server.migrate import known_revisions, newest, revision, upgrade
from parenting.server.settings import Settings
from parenting.server.store import high_water
from parenting.server.store.owner import exists, give
from parenting.server.store.sqlite import make_folder
from parenting.server.store.url import database_url

BESIDE = ("-wal", "-shm", "-journal")


@dataclass(frozen=True)
class Restored:
    """The outcome of a restore."""

    database: str
    holds: str
    aside: Path | None  # where the former database is
    older: bool  # the next start migrates it


def restore(settings: Settings, file: Path, replace: bool = False, new_identity: bool = False) -> Restored:
    """Put a backup in place of the database of these settings. Its sessions and tokens are ended.

    Args:
        settings: The settings that name the database.
        file: A file that `back_up` has written, or the file of a database that nobody has open.
        replace: Replace a database that exists; it is kept in the folder `backups`.
        new_identity: Give the copy a UUID of its own, so that it and the original are told apart. An older
            copy is migrated first.

    Raises:
        SetupError: the database is in use or exists, or the file is damaged, of a newer version or no backup.
    """
    url = database_url(settings.url)
    require_stopped(settings.data)
    if url.get_backend_name() == "postgresql":
        done = _restore_dump(settings, url, file, replace)
    else:
        done = _restore_copy(url, file, replace)
    if new_identity:
        db = connect(settings)
        try:
            upgrade(db)
            identity.renew(db)
        finally:
            db.close()
    return done


def _restore_copy(url: URL, file: Path, replace: bool) -> Restored:
    named = Path(str(url.database))
    target = file_at(named)  # beside which SQLite has its log, if the other is a link to it
    copies.require_database(file)
    if target.exists() and target.samefile(file):
        raise SetupError(f"{file} is the database itself. Name a backup.")
    if target.exists() and not replace:
        raise SetupError(f"There is a database at {target}. Give --replace to put it aside first.")
    make_folder(target.parent)
    require_room(target.parent, size(file), "Free some space first.")
    with ExitStack() as until_replaced, whole(target, force=True) as part:
        give(part)
        copies.copy(file, part)
        copies.end_access(part)
        holds = copies.check(part)
        older = _is_older(holds.revision, file)
        aside = None
        if target.exists():
            if high_water.foreign_log(target) is None:
                until_replaced.enter_context(alone(target))  # its log is in the file now, if it is sound
            aside = _put_aside(target)
    high_water.accept(named)
    return Restored(str(target), str(holds), aside, older)


def _put_aside(target: Path) -> Path:
    """Keep the database under a second name, and leave nothing of its log for the one that comes.

    The first name goes on until the new file replaces it: at no moment is there none.
    """
    aside = _aside(target.parent / FOLDER, ".db")
    aside.parent.mkdir(exist_ok=True, mode=0o700)
    give(aside.parent)
    os.link(target, aside)
    aside.chmod(0o600)
    for end in BESIDE:
        with suppress(FileNotFoundError):
            Path(f"{target}{end}").rename(f"{aside}{end}")
    return aside


def _restore_dump(settings: Settings, url: URL, file: Path, replace: bool) -> Restored:
    if not file.is_file():
        raise SetupError(f"{file} cannot be read: there is no such file. Name a backup.")
    number = dumps.check(file)
    require_unconnected(url)
    aside = None
    if revision_of(settings) is not None:
        if not replace:
            raise SetupError(
                f"{url.render_as_string()} holds tables. Give --replace to dump them aside and restore these."
            )
        aside = back_up(settings, _aside(settings.data / FOLDER, ".dump")).file
    dumps.restore(url, file)
    _end_access(settings)
    return Restored(url.render_as_string(), f"{number} tables", aside, revision_of(settings) != newest())


def _end_access(settings: Settings) -> None:
    """End the sessions and tokens of the tables that were put in place (`ended`)."""
    db = connect(settings)
    try:
        with db.engine.begin() as connection:
            for statement in statements(inspect(connection).get_table_names()):
                connection.execute(text(statement))
    finally:
        db.close()


def revision_of(settings: Settings) -> str | None:
    """Return the revision of a database's tables; None if it has none.

    Raises:
        SetupError: a newer version wrote them.
    """
    db = connect(settings)
    try:
        return revision(db)
    finally:
        db.close()


def _is_older(found: str | None, file: Path) -> bool:
    """Return whether the next start has to migrate.

    Raises:
        SetupError: a newer version wrote it, or another program.
    """
    if found is None:
        raise SetupError(f"{file} is a database of another program: it has no revision of Parenting's.")
    if found not in known_revisions():
        raise SetupError(
            f"{file} is from a newer version of Parenting (revision {found}). Update Parenting first."
        )
    return found != newest()


def _aside(folder: Path, end: str) -> Path:
    """Return a name that is free for a former database, also for a second one within the same second."""
    name = f"before-restore-{stamp(utc_now())}"
    names = (folder / f"{name}{more}{end}" for more in chain([""], (f"-{n}" for n in count(2))))
    return next(path for path in names if not exists(path))

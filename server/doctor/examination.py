"""The whole examination, in the order in which one fault explains the next."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

from sqlalchemy import URL, NullPool, create_engine

from parenting.server.columns import loads
from parenting.server.db import Database, connect
from parenting.server.doctor import files, machine, rows, server, store
from parenting.server.doctor.findings import Finding, error, guarded, ok
from parenting.server.errors import SetupError
from parenting.server.settings import Settings
from parenting.server.store.url import database_url


def examine(settings: Settings) -> Iterator[Finding]:
    """Look at everything, from the installation to the tables. Nothing is changed."""
    yield from guarded("settings", machine.settings_file)
    yield from guarded("versions", machine.versions)
    yield from guarded("limits", partial(machine.limits, settings))
    yield from guarded("weights", machine.shipped_weights)
    yield from guarded("packages", machine.packages)
    try:
        url = database_url(settings.url)
    except SetupError as refused:
        yield error("database", refused.message, "Correct it in the environment or in .env.")
        return
    if url.get_backend_name() == "sqlite":
        yield from _sqlite(settings, url)
    else:
        yield from guarded("permissions", partial(files.permissions, settings.data, None))
        yield from guarded("database", partial(_server, settings))
        yield from guarded("backups", partial(files.backups, settings.data))


def _sqlite(settings: Settings, url: URL) -> Iterator[Finding]:
    database = Path(str(url.database))
    place = database.parent
    yield from guarded("sqlite", machine.sqlite_version)
    yield from guarded("permissions", partial(files.permissions, settings.data, database))
    yield from guarded("file system", partial(files.file_system, place))
    yield from guarded("space", partial(files.space, place, database))
    yield from guarded("backups", partial(files.backups, place))
    unusable = list(guarded("mark", partial(files.beside, database)))
    yield from unusable
    if unusable:
        return
    if not database.is_file():
        remedy = "parenting up makes one; parenting restore FILE brings a backup back."
        yield error("database", f"there is none at {database}", remedy)
        return
    found = list(guarded("database", partial(files.soundness, database)))
    yield from found
    if any(one.name == "journal" for one in found):
        yield from guarded("mark", partial(files.losses, database))
        yield from _tables(_reading(database))


def _server(settings: Settings) -> Iterator[Finding]:
    db = connect(settings)
    with db.read() as session:
        session.connection()
    yield ok("database", f"{db.engine.url.render_as_string()} answers")
    yield from guarded("server", partial(server.server, db))
    yield from _tables(db)


def _tables(db: Database) -> Iterator[Finding]:
    try:
        found = list(guarded("migrations", partial(store.migrations, db)))
        yield from found
        if found and found[0].state == "ok":  # others lack columns
            yield from guarded("clock", partial(store.clock, db))
            yield from guarded("worker", partial(store.workers, db))
            yield from guarded("stored weights", partial(store.stored_weights, db))
            yield from guarded("rows", partial(rows.rows, db))
            yield from guarded("checkpoints", partial(rows.checkpoints, db))
    finally:
        db.close()


def _reading(database: Path) -> Database:
    """Open a database file without a change to it: neither its journal nor its log."""
    engine = create_engine(
        "sqlite://", creator=partial(files.opened, database), poolclass=NullPool, json_deserializer=loads
    )
    return Database(engine)

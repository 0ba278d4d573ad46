"""Import the runs of an export of format 2: their settings, their record, and where each of them was.

Everything is one transaction, so that nothing half done stays. A run keeps its public id, unless the database
has it or had it; its answers are chained afresh, and its origin names the run and the database that it is of.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError
from sqlalchemy import select
from sqlalchemy.exc import DataError, IntegrityError, SQLAlchemyError
from sqlalchemy.orm import Session

from parenting.envs import registry
from parenting.envs.levels.spec import LevelError
from parenting.server.archive.contradictions import contradiction
from parenting.server.archive.import_blobs import put_blobs
from parenting.server.archive.import_names import REMEDY, Naming
from parenting.server.archive.import_record import put_record
from parenting.server.archive.import_rules import SETTINGS as RULES
from parenting.server.archive.import_rules import shown, time, wrong_value
from parenting.server.archive.manifest import RunEntry
from parenting.server.archive.runs import STATE
from parenting.server.archive.source import Source, source
from parenting.server.archive.target import MANIFEST
from parenting.server.audit.recording import record
from parenting.server.audit.table import Kind
from parenting.server.columns import UNREADABLE
from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.identity import unused_number
from parenting.server.new_run import NewRun
from parenting.server.origins import IMPORTED
from parenting.server.public_ids import is_public_id, public_id
from parenting.server.rollback import SETTINGS
from parenting.server.run_limits import require_room
from parenting.server.statuses import LIVING
from parenting.server.store.relay import announce
from parenting.server.tables import Run, Tombstone

Progress = Callable[[int, int], None]
TIMES = ("created",)
NEW = (
    *("world", "seed", "parent", "script", "goal", "pace", "finish"),
    *("guidance_layout", "practice", "words", "remarks"),
)
"""The settings that have the rules of `NewRun`."""
LOST = ("waiting",)


class Imported(NamedTuple):
    """A run that was imported."""

    number: int
    public_id: str
    was: str  # its public id in the export
    answers: int


def import_export(
    db: Database,
    path: Path,
    checked: Progress = lambda done, total: None,
    progress: Progress = lambda d, t: None,
    most: int | None = None,
) -> list[Imported]:
    """Add the runs of an export.

    Args:
        db: The database.
        path: The folder or the zip.
        checked: Told of bytes that were held against their hashes.
        progress: Told of rows.
        most: The number of runs that may live; None is any.

    Raises:
        TooManyRunsError: more would live than may. Nothing was stored.
        SetupError: it is not an export, is damaged, or holds what cannot be used here. Nothing was stored.
    """
    with source(path) as found:
        found.verify(checked)
        _require_runs(path, found.manifest.runs)
        try:
            with db.write() as session:
                return _put(session, db, found, progress, most)
        except (IntegrityError, DataError):
            raise SetupError(f"{path}: {contradiction(found)}. {REMEDY}") from None
        except (SQLAlchemyError, ValidationError, *UNREADABLE) as error:
            raise SetupError(
                f"{path} cannot be imported: {type(error).__name__}: {str(error).splitlines()[0][:200]}. "
                "Nothing was imported."
            ) from None


def _put(
    session: Session, db: Database, found: Source, progress: Progress, most: int | None
) -> list[Imported]:
    naming = {}
    runs = []
    for entry in found.manifest.runs:
        if most is not None and entry.settings["status"] in LIVING:
            require_room(session, most)
        run = _run(session, db.clock(), found, entry)
        naming[entry.run] = Naming(run.id, run.public_id, entry.run)
        put_blobs(session, db.clock(), found, entry, run)
        runs.append(Imported(run.id, run.public_id, entry.run, entry.counts.answers))
    put_record(session, found, naming, progress)
    for one in runs:
        record(db, session, Kind.OPERATOR, "import", one.public_id)
    announce(session, "worker")
    return runs


def _run(session: Session, now: datetime, found: Source, entry: RunEntry) -> Run:
    told = entry.settings
    run = Run(id=unused_number(session, Run), public_id=unused_id(session, entry.run))
    for name in (*SETTINGS, *STATE):
        value = None if name in LOST else told[name]
        setattr(run, name, time(value) if name in TIMES and value is not None else value)
    where = {"run": entry.run, "number": entry.number, "database": found.manifest.database}
    run.origin = {**(run.origin or {}), IMPORTED: {**where, "manifest": found.sha256}}
    run.created = now if told["created"] is None else run.created
    session.add(run)
    session.flush()
    session.refresh(run)  # as the columns' types read it
    wrong = damage(run)
    if wrong is not None:
        raise SetupError(f"Run {entry.number} of the export cannot be used: {wrong}. Nothing was imported.")
    return run


def unused_id(session: Session, wanted: str) -> str:
    """Return a public id for a run: the wanted one, unless the database has such a run or had it."""
    taken = session.scalar(select(Run.id).where(Run.public_id == wanted))
    buried = session.scalar(select(Tombstone.id).where(Tombstone.public_id == wanted))
    return public_id() if taken or buried or not is_public_id(wanted) else wanted


def _require_runs(path: Path, entries: Sequence[RunEntry]) -> None:
    """Refuse runs that could not go on here, and one that the manifest names twice.

    Raises:
        SetupError: there is one.
    """
    seen = set[str]()
    for entry in entries:
        _require_settings(path, entry)
        _require_world(path, entry)
        if entry.run in seen:
            twice = shown("run", entry.run, "another run of the manifest has this id")
            raise SetupError(f"{path}: {MANIFEST}: run {entry.number}: {twice}. {REMEDY}")
        seen.add(entry.run)


def _require_world(path: Path, entry: RunEntry) -> None:
    world, text = str(entry.settings.get("world")), str(entry.settings.get("level_text"))
    if not registry.knows(world, text):
        raise SetupError(
            f"{path}: run {entry.number} is of the world {world}, which is not installed here. "
            "Install its package."
        )
    try:
        registry.level(world, text)
    except LevelError as error:
        raise SetupError(f"{path}: run {entry.number}: its level cannot be read: {error}") from None


def _require_settings(path: Path, entry: RunEntry) -> None:
    """Hold a run to the rules of a new one, which its name, its times and its numbers have to keep, too."""
    told = entry.settings
    lacking = next((name for name in (*SETTINGS, *STATE) if name not in told), None)
    wrong = _of_new(told) if lacking is None else (lacking, None, "it is missing")
    if wrong is not None:
        raise SetupError(f"{path}: {MANIFEST}: run {entry.number}: {shown(*wrong)}. {REMEDY}")


def _of_new(told: Mapping[str, Any]) -> tuple[str, Any, str] | None:
    try:
        NewRun.model_validate({name: told[name] for name in NEW})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        return ".".join(map(str, first["loc"])), first["input"], first["msg"].removeprefix("Value error, ")
    return wrong_value(RULES, told)

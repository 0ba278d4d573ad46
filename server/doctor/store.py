"""The tables: their revision, the clocks, the workers, the stored weights."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

from sqlalchemy import func, select, text
from sqlalchemy.orm import Session

from parenting._plural import counted
from parenting.server.db import Database
from parenting.server.doctor.findings import Finding, error, ok, warning
from parenting.server.errors import SetupError
from parenting.server.migrate import newest, revision
from parenting.server.statuses import LIVING
from parenting.server.tables import Answer, Checkpoint, Query, Run, Weights, Worker
from parenting.server.workers import alive
from parenting.weights.store import digest

FUTURE = timedelta(seconds=5)
APART = timedelta(seconds=2)


def migrations(db: Database) -> Iterator[Finding]:
    """Compare the revision of the tables with this version's."""
    name, found = "migrations", None
    try:
        found = revision(db)
    except SetupError as newer:
        yield error(name, newer.message, "Install the newer version, or restore an older backup.")
        return
    if found == newest():
        yield ok(name, f"the tables are up to date (revision {found})")
    elif found is None:
        yield error(name, "the database has no tables yet", "parenting migrate")
    else:
        yield error(name, f"the tables are of an older version (revision {found})", "parenting migrate")


def clock(db: Database) -> Iterator[Finding]:
    """Compare this machine's clock with the newest row, and with the database's own clock."""
    with db.read() as session:
        times = [session.execute(select(func.max(column))).scalar() for column in _TIMES]
        there = _database_clock(session)
    now = datetime.now(UTC)
    newest_row = max((time for time in times if time is not None), default=None)
    if there is not None and abs(there - now) > APART:
        apart = (there - now).total_seconds()
        yield warning("clock", f"the database's clock is {apart:+.0f} s from this one's", "Set both by NTP.")
    elif newest_row is not None and newest_row > now + FUTURE:
        ahead = (newest_row - now).total_seconds()
        yield warning(
            "clock",
            f"the newest row is {ahead:.0f} s in the future: the clock was wrong then or is wrong now",
            "Set it by NTP. No answer is lost by it.",
        )
    else:
        yield ok("clock", f"{now:%Y-%m-%d %H:%M:%S} UTC")


def workers(db: Database) -> Iterator[Finding]:
    """Look for a worker that is alive, and for runs that wait for one."""
    with db.read() as session:
        living = session.execute(select(func.count()).where(Run.status.in_(LIVING))).scalar_one()
    names = alive(db)
    runs = f"{counted(living, 'run')} to train"
    if names:
        yield ok("worker", f"alive: {', '.join(names)}; {runs}")
    elif living:
        yield warning("worker", f"none gives a sign of life; {runs}", "parenting worker, or parenting up")
    else:
        yield ok("worker", f"none gives a sign of life; {runs}")


def stored_weights(db: Database) -> Iterator[Finding]:
    """Compare the stored weights with their checksums, and look for those that runs name."""
    with db.read() as session:
        names = session.scalars(select(Weights.sha256)).all()
        wanted = {sha256 for sha256 in session.scalars(select(Run.weights).distinct()) if sha256 is not None}
        damaged = [sha256 for sha256 in names if digest(_blob(session, sha256)) != sha256]
    bad = [f"{sha256[:12]} is damaged" for sha256 in damaged]
    bad += [f"{sha256[:12]} is missing" for sha256 in sorted(wanted - set(names))]
    if bad:
        remedy = "Restore a backup that has them; runs that have begun elsewhere are not touched."
        yield error("stored weights", "; ".join(bad), remedy)
    else:
        yield ok("stored weights", f"{len(names)} of {len(wanted)} that runs began with are intact")


def _blob(session: Session, sha256: str) -> bytes:
    blob: bytes = session.execute(select(Weights.blob).where(Weights.sha256 == sha256)).scalar_one()
    return blob


def _database_clock(session: Session) -> datetime | None:
    """Return the time of a database that has a clock of its own."""
    if session.get_bind().dialect.name == "sqlite":
        return None
    now: datetime = session.execute(text("SELECT clock_timestamp()")).scalar_one()
    return now


_TIMES = (Answer.received, Query.posted, Run.created, Worker.heartbeat, Checkpoint.created)

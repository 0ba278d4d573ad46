"""Add an entry to the audit log, in the transaction of what it tells."""

from __future__ import annotations

from collections.abc import Sequence

import structlog
from sqlalchemy.orm import Session

from parenting.server.audit.acting import acting
from parenting.server.audit.table import AuditEntry, Kind
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.errors import StoreError
from parenting.server.tables import Run

log = structlog.get_logger()


def record(
    db: Database,
    session: Session,
    kind: Kind,
    what: str,
    run: Run | str | None = None,
    who: str | None = None,
) -> None:
    """Add an entry in the transaction of what it tells, so that there is neither without the other.

    Args:
        db: The database, whose clock it is.
        session: The transaction.
        kind: What sort of thing was done.
        what: What was done, in words that hold nothing that people wrote.
        run: The run to which it was done, or its public id.
        who: Who did it; none is whoever acts (`audit.acting`).
    """
    actor = acting()
    name = sound(run, "public_id") if isinstance(run, Run) else run
    session.add(
        AuditEntry(
            created=db.clock(),
            kind=kind,
            what=what,
            who=who or actor.who,
            client=actor.client,
            run=name,
        )
    )


def operated(db: Database, session: Session, verb: str, run: Run) -> None:
    """Add an entry of an operator's verb."""
    record(db, session, Kind.OPERATOR, verb, run)


def note_export(db: Database, run_id: int, what: str) -> None:
    """Add an entry of an export that begins.

    While the store takes no writes, what it holds can still be saved: the log of the process says so instead.
    """
    refused = try_note_export(db, [run_id], what)
    if refused is not None:
        log.warning("an export is not in the audit log", run=run_id, what=what, reason=refused.code)


def try_note_export(db: Database, runs: Sequence[int], what: str) -> StoreError | None:
    """Add an entry of an export for each run; return why that was not possible, if it was not."""
    try:
        with db.write() as session:
            for run_id in runs:
                record(db, session, Kind.EXPORT, what, session.get(Run, run_id))
    except StoreError as error:
        return error
    return None

"""The progress of an agent, as its worker reports it: columns of its run."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from sqlalchemy import Update, bindparam, update
from sqlalchemy.orm import Session

from parenting.server.db import Database
from parenting.server.runs import Claim, held
from parenting.server.tables import Run, Table

PROGRESS_FIELDS = {"tick", "waiting", "optimal", "versions", "maturity", "speed", "milestones", "lesson"}
"""The columns that a worker reports."""
_RUN = Table.metadata.tables[Run.__tablename__]


def report_progress(db: Database, mine: Claim, **fields: Any) -> None:
    """Store the progress of an agent: any of `PROGRESS_FIELDS`. This renews the claim too.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write(durable=False) as session:
        report_in(session, db, mine, fields)


def report_in(session: Session, db: Database, mine: Claim, fields: Mapping[str, Any]) -> None:
    """Store progress as `report_progress` does, in a transaction that is already open."""
    if unknown := set(fields) - PROGRESS_FIELDS:
        raise TypeError(f"report_progress takes {sorted(PROGRESS_FIELDS)}, not {sorted(unknown)}")
    mark = db.mark(session)
    sign = {"heartbeat": db.clock(), "claim_epoch": mark.epoch, "claim_mark": mark.seconds}
    whose = {"of_run": mine.run_id, "of_worker": mine.worker, "of_token": mine.fencing_token}
    found = session.execute(_report(tuple(sorted(fields))), {**fields, **sign, **whose})
    if not found.rowcount:  # type: ignore[attr-defined]
        held(session, mine)  # it says why


@cache
def _report(fields: tuple[str, ...]) -> Update:
    """Return the statement that stores these columns of a run, with a sign of life, if its claim holds."""
    names = (*fields, "heartbeat", "claim_epoch", "claim_mark")
    mine = (_RUN.c.worker == bindparam("of_worker"), _RUN.c.fencing_token == bindparam("of_token"))
    stored = update(_RUN).where(_RUN.c.id == bindparam("of_run"), _RUN.c.deleting.is_(None), *mine)
    return stored.values({name: bindparam(name) for name in names})

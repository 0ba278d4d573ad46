"""Rows that cannot be read: each is named, with what of it is damaged and the remedy."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import select

from parenting._plural import counted
from parenting.server.checkpoints import load_checkpoints
from parenting.server.damage import damage, sound
from parenting.server.db import Database
from parenting.server.doctor.findings import Finding, error, ok, warning
from parenting.server.tables import Answer, Metric, OperatorEvent, Query, Run, Table

BATCH = 500
NAMED = 10
"""Damaged rows that are named; of others the number is told."""
NOUNS: dict[type[Table], str] = {
    Run: "run",
    Query: "question",
    Answer: "answer",
    OperatorEvent: "event",
    Metric: "metrics",
}


def rows(db: Database) -> Iterator[Finding]:
    """Read every row of runs, questions, answers, events and metrics as their readers would."""
    looked, bad = 0, 0
    named: list[str] = []
    for table in NOUNS:
        for row, found in _looked_at(db, table):
            looked += 1
            bad += found is not None
            if found is not None and len(named) < NAMED:
                named.append(f"{_name(row)}: {found}")
    if not bad:
        yield ok("rows", f"{counted(looked, 'row')} can be read")
        return
    more = [f"and {bad - len(named)} more"] if bad > len(named) else []
    yield error(
        "rows",
        "; ".join([*named, *more]),
        "Put a backup of before the damage in place: parenting restore FILE --replace. "
        "Without one nothing else is touched, and a run that failed for a question may go on: "
        "parenting resume RUN",
    )


def checkpoints(db: Database) -> Iterator[Finding]:
    """Compare every checkpoint with its checksum."""
    with db.read() as session:
        runs = session.scalars(select(Run.id).order_by(Run.id)).all()
    kept = [(run, one.tick, one.intact) for run in runs for one in load_checkpoints(db, run)]
    bad = [f"run {run} at tick {tick}" for run, tick, intact in kept if not intact]
    if bad:
        yield warning(
            "checkpoints",
            f"damaged: {', '.join(bad)}",
            "Nothing is lost: its run goes on from the one before, or lives its record again from tick 0.",
        )
    else:
        yield ok("checkpoints", f"{counted(len(kept), 'checkpoint')} intact")


def _looked_at(db: Database, table: type[Table]) -> Iterator[tuple[Table, str | None]]:
    with db.read() as session:
        for row in session.scalars(select(table).execution_options(yield_per=BATCH)):
            yield row, damage(row)


def _name(row: Table) -> str:
    if isinstance(row, Run):
        return f"run {row.id}"
    run, tick = sound(row, "run_id"), sound(row, "tick") if isinstance(row, Query | Metric) else None
    number = f" {row.id}" if isinstance(row, Query | Answer | OperatorEvent) else ""
    place = "" if tick is None else f" at tick {tick}"
    return f"{NOUNS[type(row)]}{number} of {'an unknown run' if run is None else f'run {run}'}{place}"

"""Store the metrics of a run, by tick. `server.reads.metrics` reads them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from sqlalchemy import bindparam, delete, insert

from parenting.server.db import Database
from parenting.server.progress import report_in
from parenting.server.runs import Claim, held_status
from parenting.server.tables import Metric, Table


def write_metrics(
    db: Database,
    mine: Claim,
    rows: Mapping[int, Mapping[str, float | int | None]],
    progress: Mapping[str, Any] | None = None,
) -> None:
    """Store metrics by tick.

    A replayed tick replaces its row; a number that is not finite becomes null.

    Args:
        db: The database.
        mine: The worker's claim on the run.
        rows: The metrics by tick.
        progress: The progress of the agent that is stored with them (`progress.report_progress`).

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write(durable=False) as session:
        if progress is None:
            held_status(session, mine)
        else:
            report_in(session, db, mine, progress)
        session.execute(_FORGOTTEN, {"run": mine.run_id, "ticks": list(rows)})
        session.execute(
            insert(_METRIC),
            [{"run_id": mine.run_id, "tick": t, "values": _finite(values)} for t, values in rows.items()],
        )


def _finite(values: Mapping[str, float | int | None]) -> dict[str, Any]:
    return {name: value if value is None or math.isfinite(value) else None for name, value in values.items()}


_METRIC = Table.metadata.tables[Metric.__tablename__]
_FORGOTTEN = delete(_METRIC).where(
    _METRIC.c.run_id == bindparam("run"), _METRIC.c.tick.in_(bindparam("ticks", expanding=True))
)

"""Store the metrics of a run, by tick. `server.reads.metrics` reads them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from sqlalchemy import delete

from parenting.server.db import Database
from parenting.server.runs import Claim, held
from parenting.server.tables import Metric


def write_metrics(db: Database, mine: Claim, rows: Mapping[int, Mapping[str, float | int | None]]) -> None:
    """Store metrics by tick.

    A replayed tick replaces its row; a number that is not finite becomes null.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write(durable=False) as session:
        run = held(session, mine)
        session.execute(delete(Metric).where(Metric.run_id == run.id, Metric.tick.in_(list(rows))))
        session.add_all(
            Metric(run_id=run.id, tick=tick, values=_finite(values)) for tick, values in rows.items()
        )


def _finite(values: Mapping[str, float | int | None]) -> dict[str, Any]:
    return {name: value if value is None or math.isfinite(value) else None for name, value in values.items()}

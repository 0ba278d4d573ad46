"""Clips, metrics, reasons and effects are stored in a short form (`server.compact`).

Rows of before stay as they are, and are read as before. On the way back the short ones are written out; a
damaged one stays as it is, for the older version to report.

Revision: 0026, after 0025
"""

from collections.abc import Callable
from typing import Any

import sqlalchemy as sa
from alembic import op

from parenting.server.columns import loads
from parenting.server.compact import EFFECT, METRICS, REASON, whole_clips, whole_figures

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None

FORMS = (
    ("query", "clips", ("id",), "grids", whole_clips),
    ("metric", "values", ("run_id", "tick"), "f", lambda found: whole_figures(METRICS, found)),
    ("effect", "policy", ("run_id", "tick", "ticks"), "f", lambda found: whole_figures(EFFECT, found)),
    ("reason", "why", ("run_id", "tick"), "f", lambda found: whole_figures(REASON, found)),
)
PIECE = 500
"""Rows that are held in memory at a time."""


def upgrade() -> None:
    """Do nothing: either form is read."""


def downgrade() -> None:
    for name, column, keys, mark, whole in FORMS:
        table = sa.table(name, sa.column(column, sa.JSON), *(sa.column(key, sa.BigInteger) for key in keys))
        places, stored = [table.c[key] for key in keys], sa.cast(table.c[column], sa.Text)
        short = sa.select(*places, stored).where(stored.like(f'%"{mark}"%')).order_by(*places).limit(PIECE)
        rows = op.get_bind().execute(short).all()
        while rows:
            for *place, text in rows:
                found = _written_out(text, whole)
                if found is not None:
                    here = [key == value for key, value in zip(places, place, strict=True)]
                    op.execute(table.update().where(*here).values({column: found}))
            beyond = sa.tuple_(*places) > sa.tuple_(*map(sa.literal, rows[-1][:-1]))
            rows = op.get_bind().execute(short.where(beyond)).all()


def _written_out(text: Any, whole: Callable[[dict[str, Any]], dict[str, Any]]) -> dict[str, Any] | None:
    """Return the long form; None where the text is not JSON or has another shape than the short one."""
    found = loads(text) if isinstance(text, str) else None
    try:
        return whole(found) if isinstance(found, dict) else None
    except (AttributeError, LookupError, TypeError, ValueError):
        return None

"""Clips, metrics, reasons and effects are stored in a short form (`server.compact`).

Rows of before stay as they are, and are read as before. On the way back the short ones are written out.

Revision: 0026, after 0025
"""

import sqlalchemy as sa
from alembic import op

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
        short = sa.cast(table.c[column], sa.Text).like(f'%"{mark}"%')
        while rows := op.get_bind().execute(sa.select(table).where(short).limit(PIECE)).all():
            for row in rows:
                here = [table.c[key] == getattr(row, key) for key in keys]
                op.execute(table.update().where(*here).values({column: whole(row[0])}))

"""Clips, metrics, reasons and effects are stored in a short form (`server.compact`).

Rows of before stay as they are, and are read as before. On the way back the short ones are written out; a
damaged one stays as it is, for the older version to report.

Revision: 0026, after 0025
"""

from alembic import op

from parenting.server.compact import EFFECT, METRICS, REASON, whole_clips, whole_figures
from parenting.server.store.rewriting import rewrite

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


def upgrade() -> None:
    """Do nothing: either form is read."""


def downgrade() -> None:
    for name, column, keys, mark, whole in FORMS:
        rewrite(op.get_bind(), (name, column, keys), f'%"{mark}"%', whole)

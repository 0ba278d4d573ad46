"""Whole numbers have 64 bits on PostgreSQL, as on SQLite, so that no number of the API is out of range.

Revision: 0006, after 0005
"""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

COLUMNS = {
    "answer": ("id", "query_id", "run_id", "number", "supersedes", "applied_tick"),
    "checkpoint": ("id", "run_id", "tick"),
    "database_identity": ("id", "last_run", "last_query"),
    "event": ("id", "run_id", "applied_tick"),
    "metric": ("run_id", "tick"),
    "query": ("id", "run_id", "tick", "maturity", "policy_stage", "policy_steps"),
    "run": ("id", "tick", "maturity", "answers", "goal", "fencing_token"),
}
COUNTED = ("answer", "checkpoint", "event", "query", "run")


def upgrade() -> None:
    _become("BIGINT")


def downgrade() -> None:
    _become("INTEGER")


def _become(kind: str) -> None:
    if op.get_bind().dialect.name != "postgresql":
        return
    for table, columns in COLUMNS.items():
        changes = ", ".join(f"ALTER COLUMN {column} TYPE {kind}" for column in columns)
        op.execute(sa.text(f"ALTER TABLE {table} {changes}"))
    for table in COUNTED:
        op.execute(sa.text(f"ALTER SEQUENCE {table}_id_seq AS {kind}"))

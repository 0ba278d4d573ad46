"""Leases, claims and signs of life have marks of a clock that nobody sets back (`server.store.clock`).

Revision: 0007, after 0006
"""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

ADDED = {
    "query": ("lease_epoch", "lease_begin", "lease_end"),
    "run": ("claim_epoch", "claim_mark"),
    "worker": ("epoch", "mark"),
}


def upgrade() -> None:
    # What was leased or claimed before has no mark: it is over, as after its time.
    for table, columns in ADDED.items():
        for column in columns:
            kind = sa.Text() if column.endswith("epoch") else sa.Double()
            op.add_column(table, sa.Column(column, kind, nullable=True))


def downgrade() -> None:
    for table, columns in ADDED.items():
        for column in reversed(columns):
            op.drop_column(table, column)

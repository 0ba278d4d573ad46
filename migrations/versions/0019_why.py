"""The reasons of questions and effects of answers; first leases, and replays before an answer.

What was asked before this revision keeps its gaps.

Revision: 0019, after 0018
"""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None

KEYS = {"reason": ("run_id", "tick"), "effect": ("run_id", "tick", "ticks")}
JSON = {"reason": "why", "effect": "policy"}


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    for table, keys in KEYS.items():
        op.drop_table(table, if_exists=True)  # left over where an older dump of PostgreSQL was restored
        op.create_table(
            table,
            *(sa.Column(key, number, nullable=False, autoincrement=False) for key in keys),
            sa.Column(JSON[table], sa.JSON(none_as_null=True), nullable=False),
            sa.PrimaryKeyConstraint(*keys, name=op.f(f"pk_{table}")),
        )
    op.add_column("query", sa.Column("leased", sa.DateTime(), nullable=True))
    op.add_column("answer", sa.Column("replays", number, nullable=True))


def downgrade() -> None:
    op.drop_column("answer", "replays")
    op.drop_column("query", "leased")
    for table in KEYS:
        op.drop_table(table)

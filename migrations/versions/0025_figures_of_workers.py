"""A worker says of itself how many runs it raises, how busy it is, and how long turns wait.

Workers of before this revision say nothing.

Revision: 0025, after 0024
"""

import sqlalchemy as sa
from alembic import op

revision = "0025"
down_revision = "0024"
branch_labels = None
depends_on = None


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.add_column("worker", sa.Column("runs", number, nullable=True))
    op.add_column("worker", sa.Column("lives", number, nullable=True))
    op.add_column("worker", sa.Column("busy", sa.Double(), nullable=True))
    op.add_column("worker", sa.Column("memory", sa.BigInteger(), nullable=True))
    op.add_column("worker", sa.Column("waited", sa.Double(), nullable=True))


def downgrade() -> None:
    for column in ("waited", "memory", "busy", "lives", "runs"):
        op.drop_column("worker", column)

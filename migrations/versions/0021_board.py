"""Snapshots of what a page shows of a policy. Lives of before have theirs from now on.

Revision: 0021, after 0020
"""

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None

TABLES = ("board_states", "board_snapshot")


def upgrade() -> None:
    for table in TABLES:
        op.drop_table(table, if_exists=True)  # left over where an older dump of PostgreSQL was restored
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table(
        "board_states",
        sa.Column("run_id", number, nullable=False, autoincrement=False),
        sa.Column("states", number, nullable=False),
        sa.Column("complete", sa.Boolean(), nullable=False),
        sa.Column("blob", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("run_id", name=op.f("pk_board_states")),
    )
    op.create_table(
        "board_snapshot",
        sa.Column("run_id", number, nullable=False, autoincrement=False),
        sa.Column("tick", number, nullable=False, autoincrement=False),
        sa.Column("stage", number, nullable=False, autoincrement=False),
        sa.Column("frozen", sa.Boolean(), nullable=False, server_default=sa.text("false")),
        sa.Column("answers", number, nullable=False),
        sa.Column("states", number, nullable=False),
        sa.Column("p_guid", sa.Double(), nullable=False),
        sa.Column("size", number, nullable=False),
        sa.Column("blob", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("run_id", "tick", "stage", name=op.f("pk_board_snapshot")),
    )


def downgrade() -> None:
    for table in TABLES:
        op.drop_table(table)

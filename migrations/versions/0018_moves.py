"""The moves of a life, from which its episodes are shown again. Lives of before keep theirs from now on.

Revision: 0018, after 0017
"""

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None

TABLE = "moves"


def upgrade() -> None:
    op.drop_table(TABLE, if_exists=True)  # left over where an older dump of PostgreSQL was restored
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table(
        TABLE,
        sa.Column("run_id", number, nullable=False, autoincrement=False),
        sa.Column("part", number, nullable=False, autoincrement=False),
        sa.Column("blob", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("run_id", "part", name=op.f("pk_moves")),
    )


def downgrade() -> None:
    op.drop_table(TABLE)

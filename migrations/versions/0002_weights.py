"""Pre-trained weights, and which of them a run begins with.

Revision: 0002, after 0001
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "weights",
        sa.Column("sha256", sa.Text(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("blob", sa.LargeBinary(), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("sha256", name=op.f("pk_weights")),
    )
    # No foreign key: SQLite would have to copy the table, and rows of `weights` are never deleted.
    op.add_column("run", sa.Column("weights", sa.Text(), nullable=True))


def downgrade() -> None:
    op.drop_column("run", "weights")
    op.drop_table("weights")

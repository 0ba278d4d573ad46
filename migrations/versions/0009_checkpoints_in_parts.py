"""Large checkpoints are stored in parts, each written by a transaction of its own.

Checkpoints that are there stay as they are: in one piece.

Revision: 0009, after 0008
"""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

TABLE = "checkpoint_part"


def upgrade() -> None:
    op.drop_table(TABLE, if_exists=True)  # left over where an older dump of PostgreSQL was restored
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table(
        TABLE,
        sa.Column("id", number, nullable=False),
        sa.Column("run_id", number, nullable=False),
        sa.Column("parcel", sa.Text(), nullable=False),
        sa.Column("place", number, nullable=False),
        sa.Column("blob", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_checkpoint_part")),
        sa.UniqueConstraint("parcel", "place", name=op.f("uq_checkpoint_part_parcel_place")),
    )
    op.create_index(op.f("ix_checkpoint_part_run_id"), TABLE, ["run_id"], unique=False)
    op.add_column("checkpoint", sa.Column("parcel", sa.Text(), nullable=True))


def downgrade() -> None:
    connection = op.get_bind()
    named = sa.text("SELECT id, parcel FROM checkpoint WHERE parcel IS NOT NULL")
    parts = sa.text("SELECT blob FROM checkpoint_part WHERE parcel = :parcel ORDER BY place")
    whole = sa.text("UPDATE checkpoint SET blob = :blob WHERE id = :id")
    for row in connection.execute(named).all():
        blob = b"".join(bytes(part) for part in connection.scalars(parts, {"parcel": row.parcel}))
        connection.execute(whole, {"id": row.id, "blob": blob})
    op.drop_column("checkpoint", "parcel")
    op.drop_index(op.f("ix_checkpoint_part_run_id"), TABLE)
    op.drop_table(TABLE)

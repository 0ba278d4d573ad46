"""Jobs: what pages ask of any worker. A run tells its milestones, and what the last answer changed.

Revision: 0014, after 0013
"""

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

TABLE = "job"


def upgrade() -> None:
    op.drop_table(TABLE, if_exists=True)  # left over where an older dump of PostgreSQL was restored
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table(
        TABLE,
        sa.Column("id", number, nullable=False),
        sa.Column("public_id", sa.Text(), nullable=False),
        sa.Column("run_id", number, nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("payload", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("client_id", sa.Text(), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("asked_epoch", sa.Text(), nullable=False),
        sa.Column("asked_mark", sa.Double(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("result", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("worker", sa.Text(), nullable=True),
        sa.Column("fencing_token", number, nullable=False),
        sa.Column("claim_epoch", sa.Text(), nullable=True),
        sa.Column("claim_mark", sa.Double(), nullable=True),
        sa.CheckConstraint("state IN ('waiting', 'working', 'done', 'failed')", name=op.f("ck_job_state")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_job")),
    )
    op.create_index(op.f("ix_job_public_id"), TABLE, ["public_id"], unique=True)
    op.create_index(op.f("ix_job_run_id"), TABLE, ["run_id"], unique=False)
    op.create_index(op.f("ix_job_state"), TABLE, ["state"], unique=False)
    for name in ("milestones", "lesson"):
        op.add_column("run", sa.Column(name, sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    for name in ("lesson", "milestones"):
        op.drop_column("run", name)
    op.drop_table(TABLE)

"""A run's goal, pace, stage and speed; which policy asked a query; the workers that live.

Revision: 0003, after 0002
"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # Columns are added one by one, without batch: SQLite would have to copy tables that others point to.
    op.add_column("run", sa.Column("maturity", sa.Integer(), server_default=sa.text("1"), nullable=False))
    op.add_column("run", sa.Column("speed", sa.Double(), nullable=True))
    op.add_column("run", sa.Column("goal", sa.Integer(), nullable=True))
    op.add_column("run", sa.Column("pace", sa.Double(), nullable=True))
    op.add_column("query", sa.Column("policy_stage", sa.Integer(), nullable=True))
    op.add_column("query", sa.Column("policy_steps", sa.Integer(), nullable=True))
    op.create_table(
        "worker",
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("started", sa.DateTime(), nullable=False),
        sa.Column("heartbeat", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_worker")),
    )


def downgrade() -> None:
    op.drop_table("worker")
    for column in ("policy_steps", "policy_stage"):
        op.drop_column("query", column)
    for column in ("pace", "goal", "speed", "maturity"):
        op.drop_column("run", column)

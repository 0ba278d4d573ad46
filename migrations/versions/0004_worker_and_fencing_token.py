"""The run's columns `actor` and `epoch` are named `worker` and `fencing_token`.

Revision: 0004, after 0003
"""

from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

RENAMED = {"actor": "worker", "epoch": "fencing_token"}


def upgrade() -> None:
    # SQL of its own, without batch: alembic would copy the table, and other tables refer to it.
    for old, new in RENAMED.items():
        op.execute(f"ALTER TABLE run RENAME COLUMN {old} TO {new}")


def downgrade() -> None:
    for old, new in RENAMED.items():
        op.execute(f"ALTER TABLE run RENAME COLUMN {new} TO {old}")

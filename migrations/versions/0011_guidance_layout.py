"""A run says on which boards guidance is asked: one with both moves, or the paper's two.

Runs of before were asked on two boards; their record keeps saying so.

Revision: 0011, after 0010
"""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "run", sa.Column("guidance_layout", sa.Text(), server_default=sa.text("'two'"), nullable=False)
    )


def downgrade() -> None:
    op.drop_column("run", "guidance_layout")

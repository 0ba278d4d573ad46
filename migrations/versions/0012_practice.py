"""A run says whether its parent has to practise before the first question.

Revision: 0012, after 0011
"""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "run", sa.Column("practice", sa.Text(), server_default=sa.text("'offered'"), nullable=False)
    )


def downgrade() -> None:
    op.drop_column("run", "practice")

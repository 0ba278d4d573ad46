"""A run says whether its questions in words tell how long safe ways are. Those of before did not.

Revision: 0015, after 0014
"""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("run", sa.Column("words", sa.Text(), server_default=sa.text("'plain'"), nullable=False))


def downgrade() -> None:
    op.drop_column("run", "words")

"""A person's data can be deleted: erased answers say so, and so does a person whose deletion goes on.

Revision: 0030, after 0029
"""

import sqlalchemy as sa
from alembic import op

from parenting.server.errors import SetupError

revision = "0030"
down_revision = "0029"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("answer", sa.Column("erased", sa.DateTime(), nullable=True))
    op.add_column("person", sa.Column("deleting", sa.DateTime(), nullable=True))


def downgrade() -> None:
    """Drop both columns. An older version would take erased answers for skips, and replay them so.

    Raises:
        SetupError: an answer was erased, or a person's deletion is not over.
    """
    marked = "SELECT count(*) FROM answer WHERE erased IS NOT NULL"
    pending = "SELECT count(*) FROM person WHERE deleting IS NOT NULL"
    if op.get_bind().scalar(sa.text(marked)) or op.get_bind().scalar(sa.text(pending)):
        raise SetupError(
            f"A person's data were or are being deleted, which revision {down_revision} does not know."
        )
    op.drop_column("person", "deleting")
    op.drop_column("answer", "erased")

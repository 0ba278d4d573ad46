"""A run that a script answers says how that script errs; until this revision it never did.

Revision: 0020, after 0019
"""

import sqlalchemy as sa
from alembic import op

from parenting.server.errors import SetupError

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("run", sa.Column("script", sa.Text(), nullable=True))
    op.execute(sa.text("UPDATE run SET script = 'scripted' WHERE parent = 'scripted'"))


def downgrade() -> None:
    """Drop the column. The older version would answer without the errors.

    Raises:
        SetupError: there is a script that errs.
    """
    run = op.get_bind().scalar(sa.text("SELECT min(id) FROM run WHERE script <> 'scripted'"))
    if run is not None:
        raise SetupError(
            f"The script of run {run} errs, which revision {down_revision} does not know. "
            "Restore the copy from before the migration."
        )
    op.drop_column("run", "script")

"""A run keeps what it began with: an earlier policy, earlier answers, or another run up to a tick.

Runs of before this revision began with none of these.

Revision: 0023, after 0022
"""

import sqlalchemy as sa
from alembic import op

from parenting.server.errors import SetupError

revision = "0023"
down_revision = "0022"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("run", sa.Column("origin", sa.JSON(), nullable=True))


def downgrade() -> None:
    """Drop the column. The older version would replay such a run from another beginning.

    Raises:
        SetupError: there is a run that began with an earlier policy, answers or run.
    """
    run = op.get_bind().scalar(sa.text("SELECT min(id) FROM run WHERE origin IS NOT NULL"))
    if run is not None:
        raise SetupError(
            f"Run {run} began with an earlier policy, answers or run, which revision {down_revision} does not"
            " know. Restore the copy from before the migration."
        )
    op.drop_column("run", "origin")

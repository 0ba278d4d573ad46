"""A run may be a trial of a batch that was raised in tensors: which batch, and which of its trials.

Runs of before this revision are trials of none.

Revision: 0024, after 0023
"""

import sqlalchemy as sa
from alembic import op

from parenting.server.errors import SetupError

revision = "0024"
down_revision = "0023"
branch_labels = None
depends_on = None


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.add_column("run", sa.Column("batch", sa.Text(), nullable=True))
    op.add_column("run", sa.Column("trial", number, nullable=True))


def downgrade() -> None:
    """Drop the columns. The older version would offer to go on with a run that has no checkpoint.

    Raises:
        SetupError: there is a trial of a batch.
    """
    run = op.get_bind().scalar(sa.text("SELECT min(id) FROM run WHERE batch IS NOT NULL"))
    if run is not None:
        raise SetupError(
            f"Run {run} is a trial of a batch, which revision {down_revision} would offer to resume. "
            "Delete such runs, or restore the copy from before the migration."
        )
    op.drop_column("run", "trial")
    op.drop_column("run", "batch")

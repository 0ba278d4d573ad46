"""A question says how many answers were heard before on the same pair of moves in the same pause.

What was asked before this revision was asked for the first time.

Revision: 0017, after 0016
"""

import sqlalchemy as sa
from alembic import op

from parenting.server.errors import SetupError

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.add_column("query", sa.Column("votes", number, nullable=False, server_default=sa.text("0")))


def downgrade() -> None:
    """Drop the column. The older version cannot read the config of a run that asks again.

    Raises:
        SetupError: there is a question that was asked again.
    """
    run = op.get_bind().scalar(sa.text("SELECT min(run_id) FROM query WHERE votes > 0"))
    if run is not None:
        raise SetupError(
            f"In run {run} a question was asked again, which revision {down_revision} does not know. "
            "Restore the copy from before the migration."
        )
    op.drop_column("query", "votes")

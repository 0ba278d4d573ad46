"""Runs are described, tagged, archived and deleted; deleted ones leave a tombstone. Runs say what ends them.

Up to now a script's run ended once its policy was optimal, and a person's never ended by itself.

Revision: 0022, after 0021
"""

import sqlalchemy as sa
from alembic import op

from parenting.server.errors import SetupError

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None

TABLE = "tombstone"
WORDS = ("finish", "tags")
MAYBE = ("deleting", "archived", "description")


def upgrade() -> None:
    op.drop_table(TABLE, if_exists=True)  # left over where an older dump of PostgreSQL was restored
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table(
        TABLE,
        sa.Column("id", number, autoincrement=False, nullable=False),
        sa.Column("public_id", sa.Text(), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("deleted", sa.DateTime(), nullable=False),
        sa.Column("gone", sa.DateTime(), nullable=True),
        sa.Column("held", sa.JSON(none_as_null=True), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_tombstone")),
    )
    op.create_index(op.f("ix_tombstone_public_id"), TABLE, ["public_id"], unique=True)
    op.create_index(op.f("ix_answer_supersedes"), "answer", ["supersedes"], unique=False)
    op.add_column("run", sa.Column("description", sa.Text(), nullable=True))
    op.add_column("run", sa.Column("tags", sa.Text(), server_default=sa.text("''"), nullable=False))
    for moment in ("archived", "deleting"):
        op.add_column("run", sa.Column(moment, sa.DateTime(), nullable=True))
    never = sa.text("'never'")
    op.add_column("run", sa.Column("finish", sa.Text(), server_default=never, nullable=False))
    op.execute("UPDATE run SET finish = 'optimal' WHERE parent <> 'human'")


def downgrade() -> None:
    """Drop names of sorts, and tombstones. An older version would end a run by its own rule.

    Raises:
        SetupError: there is a run that another rule ends, or one whose deletion is not over.
    """
    usual = "CASE WHEN parent = 'human' THEN 'never' ELSE 'optimal' END"
    other = f"SELECT min(id) FROM run WHERE finish <> {usual} OR deleting IS NOT NULL"
    run = op.get_bind().scalar(sa.text(other))
    if run is not None:
        raise SetupError(
            f"Run {run} ends by a rule that revision {down_revision} does not know, or is being deleted. "
            "Restore the copy from before the migration."
        )
    for column in (*WORDS, *MAYBE):
        op.drop_column("run", column)
    op.drop_index(op.f("ix_answer_supersedes"), table_name="answer")
    op.drop_table(TABLE)

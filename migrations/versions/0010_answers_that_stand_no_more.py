"""Each run counts the answers that stand no more, and the answers to a question are found by an index.

Revision: 0010, after 0009
"""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.add_column("run", sa.Column("retracted", number, nullable=False, server_default=sa.text("0")))
    op.execute(
        "UPDATE run SET retracted = "
        "(SELECT count(*) FROM answer WHERE answer.run_id = run.id AND NOT answer.standing)"
    )
    op.create_index(op.f("ix_answer_query_id"), "answer", ["query_id"], unique=False)


def downgrade() -> None:
    """Let an answer stand again where it was taken back: the version before takes no second one."""
    op.execute(
        "UPDATE answer SET standing = true WHERE id IN (SELECT max(answer.id) FROM answer JOIN query ON "
        "query.id = answer.query_id WHERE query.status = 'open' GROUP BY answer.query_id)"
    )
    op.execute(
        "UPDATE query SET status = 'answered' WHERE status = 'open' "
        "AND id IN (SELECT query_id FROM answer WHERE standing)"
    )
    op.drop_index(op.f("ix_answer_query_id"), "answer")
    op.drop_column("run", "retracted")

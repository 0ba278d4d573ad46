"""A guidance question that the agent waits for no more says so, and is not asked again by a run that goes on.

Those of episodes that were ended are known by their events; those that a correction withdrew are not.

Revision: 0013, after 0012
"""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.add_column("query", sa.Column("withdrawn_tick", number))
    ended = (
        "(SELECT max(event.applied_tick) FROM event "
        "WHERE event.run_id = query.run_id AND event.kind = 'end_episode')"
    )
    op.execute(
        f"UPDATE query SET withdrawn_tick = {ended} "
        f"WHERE status = 'withdrawn' AND kind = 'guidance' AND tick < {ended}"
    )


def downgrade() -> None:
    op.drop_column("query", "withdrawn_tick")

"""A chain of hashes over the answers of each run. Those that are there are hashed now, and marked so.

Revision: 0008, after 0007
"""

import itertools

import sqlalchemy as sa
from alembic import op

from parenting.server.chain import (
    AT_MIGRATION,
    BEGIN,
    OF_ANSWER,
    OF_QUERY,
    UNLESS_ZERO,
    content,
    digest_of,
    link_after,
    new_salt,
)
from parenting.server.tables import Answer, Query

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

ASKED = tuple(name for name in OF_QUERY if name not in UNLESS_ZERO)  # those of this revision
COLUMNS = ("salt", "digest", "link", "chained")
NOTES = ("failed", "resumed", "checkpoint_damaged", "machine_changed")
BATCH = 500


def upgrade() -> None:
    for name in COLUMNS:
        op.add_column("answer", sa.Column(name, sa.Text(), nullable=True))
    connection = op.get_bind()
    for run_id in connection.scalars(sa.text("SELECT DISTINCT run_id FROM answer")).all():
        _chain(connection, run_id)


def downgrade() -> None:
    for name in reversed(COLUMNS):
        op.drop_column("answer", name)
    listed = ", ".join(f"'{kind}'" for kind in NOTES)
    op.execute(f"DELETE FROM event WHERE kind IN ({listed})")  # older versions know no notes


def _chain(connection: sa.Connection, run_id: object) -> None:
    answer, query = Answer.__table__, Query.__table__
    columns = [answer.c.id, *(answer.c[name] for name in OF_ANSWER)]
    asked = [query.c[name].label(f"query_{name}") for name in ASKED]
    rows = sa.select(*columns, *asked).outerjoin(query, answer.c.query_id == query.c.id)
    rows = rows.where(answer.c.run_id == run_id).order_by(answer.c.number)
    hashed_in = sa.table("answer", sa.column("id"), *(sa.column(name, sa.Text) for name in COLUMNS))
    given = hashed_in.update().where(hashed_in.c.id == sa.bindparam("row"))
    before = BEGIN
    for first in itertools.count(0, BATCH):
        found = connection.execute(rows.limit(BATCH).offset(first)).mappings().all()
        if not found:
            return
        hashed = []
        for row in found:
            salt = new_salt()
            digest = digest_of(salt, content(row, {name: row[f"query_{name}"] for name in ASKED}))
            before = link_after(before, digest)
            hashes = {"salt": salt, "digest": digest, "link": before, "chained": AT_MIGRATION}
            hashed.append({"row": row["id"], **hashes})
        connection.execute(given, hashed)

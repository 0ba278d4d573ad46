"""The database's identity, public ids of runs and queries, and numbers that are never given twice.

Revision: 0005, after 0004
"""

import secrets
import uuid
from datetime import UTC, datetime

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

ALPHABET = "123456789ABCDEFGHJKLMNPQRSTUVWXYZabcdefghijkmnopqrstuvwxyz"
LENGTH, BATCH = 22, 1000
TABLES = ("run", "query")


def upgrade() -> None:
    identity = op.create_table(
        "database_identity",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("uuid", sa.Text(), nullable=False),
        sa.Column("since", sa.DateTime(), nullable=False),
        sa.Column("copied_from", sa.Text(), nullable=True),
        sa.Column("last_run", sa.Integer(), server_default=sa.text("0"), nullable=False),
        sa.Column("last_query", sa.Integer(), server_default=sa.text("0"), nullable=False),
        sa.CheckConstraint("id = 1", name=op.f("ck_database_identity_one_row")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_database_identity")),
    )
    now = datetime.now(UTC).replace(tzinfo=None)
    op.bulk_insert(identity, [{"id": 1, "uuid": str(uuid.uuid4()), "since": now}])
    for table in TABLES:
        # Added one by one, without batch: SQLite would have to copy tables that others point to.
        op.add_column(table, sa.Column("public_id", sa.Text(), server_default=sa.text("''"), nullable=False))
        _draw(table)
        op.create_index(op.f(f"ix_{table}_public_id"), table, ["public_id"], unique=True)
        if op.get_bind().dialect.name == "sqlite":  # elsewhere the database's own counter never goes back
            op.execute(
                f"CREATE TRIGGER keep_deleted_{table} AFTER DELETE ON {table} BEGIN UPDATE database_identity "
                f"SET last_{table} = OLD.id WHERE last_{table} < OLD.id; END"
            )


def downgrade() -> None:
    for table in TABLES:
        if op.get_bind().dialect.name == "sqlite":
            op.execute(f"DROP TRIGGER keep_deleted_{table}")
        op.drop_index(op.f(f"ix_{table}_public_id"), table_name=table)
        op.drop_column(table, "public_id")
    op.drop_table("database_identity")


def _draw(name: str) -> None:
    """Give every row that is there a public id of its own."""
    table = sa.table(name, sa.column("id", sa.Integer), sa.column("public_id", sa.Text))
    connection = op.get_bind()
    numbers = connection.scalars(sa.select(table.c.id).order_by(table.c.id)).all()
    given = table.update().where(table.c.id == sa.bindparam("number"))
    for first in range(0, len(numbers), BATCH):
        rows = [{"number": number, "public_id": _public_id()} for number in numbers[first : first + BATCH]]
        connection.execute(given, rows)


def _public_id() -> str:
    return "".join(secrets.choice(ALPHABET) for _ in range(LENGTH))

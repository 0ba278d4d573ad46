"""Tokens and sessions: who may do what. A database of before has none of them.

Revision: 0027, after 0026
"""

import sqlalchemy as sa
from alembic import op

revision = "0027"
down_revision = "0026"
branch_labels = None
depends_on = None

TABLES = ("access_token", "access_session")
ROLES = "role IN ('researcher', 'parent', 'viewer')"


def upgrade() -> None:
    for table in TABLES:
        op.drop_table(table, if_exists=True)  # left over where an older dump of PostgreSQL was restored
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table(
        "access_token",
        sa.Column("id", number, nullable=False),
        sa.Column("public_id", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("role", sa.Text(), nullable=False),
        sa.Column("run_id", number, nullable=True),
        sa.Column("study", sa.Text(), nullable=True),
        sa.Column("name", sa.Text(), nullable=True),
        sa.Column("client_id", sa.Text(), nullable=True),
        sa.Column("made_by", sa.Text(), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("expires", sa.DateTime(), nullable=False),
        sa.Column("last_used", sa.DateTime(), nullable=True),
        sa.Column("used", sa.DateTime(), nullable=True),
        sa.Column("revoked", sa.DateTime(), nullable=True),
        sa.CheckConstraint("kind IN ('opening', 'program', 'link')", name=op.f("ck_access_token_kind")),
        sa.CheckConstraint(ROLES, name=op.f("ck_access_token_role")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_access_token")),
    )
    op.create_table(
        "access_session",
        sa.Column("id", number, nullable=False),
        sa.Column("public_id", sa.Text(), nullable=False),
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("token_id", number, nullable=True),
        sa.Column("role", sa.Text(), nullable=False),
        sa.Column("run_id", number, nullable=True),
        sa.Column("name", sa.Text(), nullable=True),
        sa.Column("client_id", sa.Text(), nullable=True),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("expires", sa.DateTime(), nullable=False),
        sa.Column("last_used", sa.DateTime(), nullable=False),
        sa.Column("revoked", sa.DateTime(), nullable=True),
        sa.CheckConstraint(ROLES, name=op.f("ck_access_session_role")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_access_session")),
    )
    for table in TABLES:
        for column in ("public_id", "digest"):
            op.create_index(op.f(f"ix_{table}_{column}"), table, [column], unique=True)
        op.create_index(op.f(f"ix_{table}_run_id"), table, ["run_id"], unique=False)
    op.create_index(op.f("ix_access_session_token_id"), "access_session", ["token_id"], unique=False)
    op.add_column(
        "database_identity",
        sa.Column("access_revision", number, nullable=False, server_default=sa.text("0")),
    )


def downgrade() -> None:
    op.drop_column("database_identity", "access_revision")
    for table in TABLES:
        op.drop_table(table)

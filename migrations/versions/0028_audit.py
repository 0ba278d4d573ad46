"""The audit log: who did what, and what was refused.

Revision: 0028, after 0027
"""

import sqlalchemy as sa
from alembic import op

revision = "0028"
down_revision = "0027"
branch_labels = None
depends_on = None

KINDS = ("login", "logout", "refusal", "token", "revocation", "export", "deletion", "operator")


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    listed = ", ".join(f"'{kind}'" for kind in KINDS)
    op.create_table(
        "audit",
        sa.Column("id", number, nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("what", sa.Text(), nullable=False),
        sa.Column("who", sa.Text(), nullable=False),
        sa.Column("client", sa.Text(), nullable=True),
        sa.Column("run", sa.Text(), nullable=True),
        sa.Column("count", number, server_default=sa.text("1"), nullable=False),
        sa.CheckConstraint(f"kind IN ({listed})", name=op.f("ck_audit_kind")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_audit")),
    )


def downgrade() -> None:
    op.drop_table("audit")

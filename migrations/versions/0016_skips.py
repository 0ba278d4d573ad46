"""A parent may skip a question: answers and runs know the words, questions know what became of a skip.

SQLite changes no CHECK, so the text of its schema is rewritten, as its documentation describes; rows stay.

Revision: 0016, after 0015
"""

import sqlalchemy as sa
from alembic import op

from parenting.server.errors import SetupError

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None

CHECKS = {
    "answer": ("choice", "choice IN ('left', 'right', 'either', 'neither'{})", "skip"),
    "run": ("waiting", "waiting IS NULL OR waiting IN ('guidance', 'preferences', 'stuck'{})", "unsure"),
}
"""By table: a column, the rule on its words, and the word that is new."""
FLAGS = {"query": ("put_back",), "run": ("remarks",)}


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.add_column("run", sa.Column("skipped", number, nullable=False, server_default=sa.text("0")))
    for table, flags in FLAGS.items():
        for flag in flags:
            false = sa.text("false")
            op.add_column(table, sa.Column(flag, sa.Boolean(), nullable=False, server_default=false))
    _rewrite({table: (_without(table), _with(table)) for table in CHECKS})


def downgrade() -> None:
    """Take the words back. A run in which something was skipped cannot be told in the words of before.

    Raises:
        SetupError: there is such a run.
    """
    skips = op.get_bind().scalar(sa.text("SELECT min(run_id) FROM answer WHERE choice = 'skip'"))
    if skips is not None:
        raise SetupError(
            f"In run {skips} a question was skipped, which revision {down_revision} does not know. "
            "Restore the copy from before the migration."
        )
    op.execute("UPDATE run SET waiting = NULL WHERE waiting = 'unsure'")
    for table, flags in FLAGS.items():
        for flag in flags:
            op.drop_column(table, flag)
    op.drop_column("run", "skipped")
    _rewrite({table: (_with(table), _without(table)) for table in CHECKS})


def _without(table: str) -> str:
    return CHECKS[table][1].format("")


def _with(table: str) -> str:
    _, rule, word = CHECKS[table]
    return rule.format(f", '{word}'")


def _rewrite(rules: dict[str, tuple[str, str]]) -> None:
    """Put another rule in the place of each table's old one."""
    connection = op.get_bind()
    if connection.dialect.name == "postgresql":
        for table, (_, now) in rules.items():
            name = f"ck_{table}_{CHECKS[table][0]}"
            connection.exec_driver_sql(f"ALTER TABLE {table} DROP CONSTRAINT {name}")
            connection.exec_driver_sql(f"ALTER TABLE {table} ADD CONSTRAINT {name} CHECK ({now})")
        return
    connection.exec_driver_sql("PRAGMA writable_schema = on")
    for table, (before, now) in rules.items():
        statement = sa.text(
            "UPDATE sqlite_schema SET sql = replace(sql, :before, :now) "
            "WHERE type = 'table' AND name = :table AND instr(sql, :before) > 0"
        )
        found = connection.execute(statement, {"before": before, "now": now, "table": table})
        if found.rowcount != 1:
            raise SetupError(f"The table {table} has another rule than this version made: {before}.")
    connection.exec_driver_sql("PRAGMA writable_schema = reset")

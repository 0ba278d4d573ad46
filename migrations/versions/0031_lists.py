"""Clips, metrics, reasons and effects are stored as lists, hashes as bytes; most answers supersede nothing.

Rows of before stay as they are, and are read as before; only PostgreSQL's columns of hashes change their
type. On the way back lists are written in the short forms of revision 0026, and hashes as digits; a damaged
value stays as it is, for the older version to report.

Revision: 0031, after 0030
"""

from functools import partial

import sqlalchemy as sa
from alembic import op

from parenting.server.compact import EFFECT, METRICS, REASON, shorten_clips, shorten_figures
from parenting.server.compact_lists import clips_of, figures_of
from parenting.server.store.rewriting import rewrite

revision = "0031"
down_revision = "0030"
branch_labels = None
depends_on = None

SUPERSEDES = "ix_answer_supersedes"
FIGURES = (
    (("metric", "values", ("run_id", "tick")), METRICS),
    (("effect", "policy", ("run_id", "tick", "ticks")), EFFECT),
    (("reason", "why", ("run_id", "tick")), REASON),
)


HASHES = ("salt", "digest", "link")
TO_BYTES = (
    "CASE WHEN {0} ~ '^([0-9a-f]{{2}})+$' AND {0} !~ '^746578743a' THEN decode({0}, 'hex') "
    "ELSE convert_to('text:' || {0}, 'UTF8') END"
)
TO_TEXT = (
    "CASE WHEN substring({0} FROM 1 FOR 5) = 'text:'::bytea THEN convert_from(substring({0} FROM 6), 'UTF8') "
    "ELSE encode({0}, 'hex') END"
)
"""Text that is not a hash stays legible (`server.columns.Hex`)."""


def upgrade() -> None:
    op.drop_index(SUPERSEDES, "answer")
    some = sa.text("supersedes IS NOT NULL")
    op.create_index(SUPERSEDES, "answer", ["supersedes"], sqlite_where=some, postgresql_where=some)
    if op.get_bind().dialect.name == "postgresql":
        _change_type("bytea", TO_BYTES)


def downgrade() -> None:
    op.drop_index(SUPERSEDES, "answer")
    op.create_index(SUPERSEDES, "answer", ["supersedes"])
    here = op.get_bind()
    rewrite(here, ("query", "clips", ("id",)), "[%", lambda found: shorten_clips(clips_of(found)))
    for place, names in FIGURES:
        rewrite(here, place, "[%", partial(_short, names))
    if here.dialect.name == "postgresql":
        _change_type("text", TO_TEXT)
        return
    for name in HASHES:
        op.execute(f"UPDATE answer SET {name} = lower(hex({name})) WHERE typeof({name}) = 'blob'")


def _change_type(to: str, using: str) -> None:
    """Change the type of all three at once: the table is written once."""
    changes = (f"ALTER COLUMN {name} TYPE {to} USING {using.format(name)}" for name in HASHES)
    op.execute(f"ALTER TABLE answer {', '.join(changes)}")


def _short(names: tuple[str, ...], listed: list[object]) -> dict[str, object]:
    return shorten_figures(names, figures_of(names, listed))

"""Answers have measures, and people who answer have pseudonyms; their names stand in a table apart.

Whoever has answered up to now gets a pseudonym, one for each browser or program. Nothing was measured then.

Revision: 0029, after 0028
"""

import sqlalchemy as sa
from alembic import op

from parenting.server.errors import SetupError
from parenting.server.persons import new_pseudonym

revision = "0029"
down_revision = "0028"
branch_labels = None
depends_on = None

NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
TABLES = ("person_name", "person_client", "person")


def upgrade() -> None:
    for table in TABLES:
        op.drop_table(table, if_exists=True)  # left over where an older dump of PostgreSQL was restored
    op.add_column("answer", sa.Column("measured", sa.Text(), nullable=True))
    op.create_table(
        "person",
        sa.Column("id", NUMBER, nullable=False),
        sa.Column("pseudonym", sa.Text(), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_person")),
        sa.UniqueConstraint("pseudonym", name=op.f("uq_person_pseudonym")),
    )
    of_person = {"columns": ["person_id"], "refcolumns": ["person.id"]}
    op.create_table(
        "person_client",
        sa.Column("client_id", sa.Text(), nullable=False),
        sa.Column("person_id", NUMBER, nullable=False),
        sa.ForeignKeyConstraint(**of_person, name=op.f("fk_person_client_person_id")),
        sa.PrimaryKeyConstraint("client_id", name=op.f("pk_person_client")),
    )
    op.create_index(op.f("ix_person_client_person_id"), "person_client", ["person_id"], unique=False)
    op.create_table(
        "person_name",
        sa.Column("person_id", NUMBER, autoincrement=False, nullable=False),
        sa.Column("name", sa.Text(), nullable=True),
        sa.Column("external_id", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(**of_person, name=op.f("fk_person_name_person_id")),
        sa.PrimaryKeyConstraint("person_id", name=op.f("pk_person_name")),
    )
    _name_those_who_answered()


def _name_those_who_answered() -> None:
    here = op.get_bind()
    moment = sa.Text() if here.dialect.name == "sqlite" else sa.DateTime()  # as it is, damaged or not
    said = sa.table("answer", sa.column("client_id", sa.Text), sa.column("parent", sa.Text))
    said.append_column(sa.column("received", moment))
    first = sa.func.min(said.c.received).label("first")
    people = sa.select(said.c.client_id, first).where(said.c.parent == "human").group_by(said.c.client_id)
    person = sa.table("person", sa.column("id"), sa.column("pseudonym"), sa.column("created", moment))
    client = sa.table("person_client", sa.column("client_id"), sa.column("person_id"))
    number = 0
    for number, (name, since) in enumerate(here.execute(people.order_by(first)).all(), start=1):
        op.execute(person.insert().values(id=number, pseudonym=new_pseudonym(), created=since))
        op.execute(client.insert().values(client_id=name, person_id=number))
    if number and here.dialect.name == "postgresql":
        op.execute(f"SELECT setval('person_id_seq', {number})")


def downgrade() -> None:
    """Drop measures, pseudonyms and names.

    Raises:
        SetupError: an answer was measured: the older version would take it for one that was changed.
    """
    run = op.get_bind().scalar(sa.text("SELECT min(run_id) FROM answer WHERE measured IS NOT NULL"))
    if run is not None:
        raise SetupError(
            f"Run {run} has answers with measures, which revision {down_revision} does not know. "
            "Restore the copy from before the migration."
        )
    for table in TABLES:
        op.drop_table(table)
    op.drop_column("answer", "measured")

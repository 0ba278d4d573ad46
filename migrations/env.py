"""Alembic's environment. It uses the connection that `server.migrate` has opened."""

from alembic import context

from parenting.server.tables import Table

connection = context.config.attributes.get("connection")
if connection is None:
    raise SystemExit("Migrations run by `parenting migrate`, which knows the database and its settings.")

context.configure(
    connection=connection,
    target_metadata=Table.metadata,
    render_as_batch=True,  # SQLite changes a table by copying it
    transactional_ddl=True,  # ours is one transaction, in SQLite too
)
context.run_migrations()

"""Migrations: they make the tables of `server.tables`, once, and refuse what they do not know."""

from collections.abc import Iterator

import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, text

from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.migrate import FOLDER, downgrade, known_revisions, require_current, upgrade
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from parenting.server.tables import Table
from tests.database import database_url, unmigrated


@pytest.fixture
def empty(settings: Settings) -> Iterator[Database]:
    database = unmigrated(settings)
    yield database
    database.close()


def checks(connection: Connection) -> dict[str, list[str]]:
    """Each table's and index's own SQL by parts: alembic compares neither CHECKs nor partial indices."""
    if connection.dialect.name == "postgresql":
        return postgresql_checks(connection)
    query = "SELECT name, sql FROM sqlite_schema WHERE sql IS NOT NULL AND name != 'alembic_version'"
    found = {}
    for name, sql in connection.execute(text(query)):
        plain = "".join(sql.split()).replace('"', "")
        body = plain[:-1] if plain.startswith("CREATETABLE") else plain  # without the last parenthesis
        # a column that a migration added stands behind the constraints, so the order says nothing
        found[name] = sorted(part.removeprefix("CONSTRAINT") for part in body.split(","))
    return found


def postgresql_checks(connection: Connection) -> dict[str, list[str]]:
    """Each table's columns, constraints and indices, as PostgreSQL writes them down."""
    query = """
        SELECT relname, attname || ' ' || format_type(atttypid, atttypmod) || ' ' || attnotnull
          || coalesce(' ' || pg_get_expr(adbin, adrelid), '')
          FROM pg_attribute JOIN pg_class ON attrelid = pg_class.oid
          LEFT JOIN pg_attrdef ON adrelid = attrelid AND adnum = attnum
         WHERE relkind = 'r' AND relnamespace = 'public'::regnamespace AND attnum > 0 AND NOT attisdropped
        UNION ALL SELECT conrelid::regclass::text, conname || ' ' || pg_get_constraintdef(oid)
          FROM pg_constraint WHERE connamespace = 'public'::regnamespace
        UNION ALL SELECT tablename, indexdef FROM pg_indexes WHERE schemaname = 'public'
        UNION ALL SELECT sequencename, data_type::text FROM pg_sequences WHERE schemaname = 'public'
        """
    found: dict[str, list[str]] = {}
    for name, part in sorted(map(tuple, connection.execute(text(query)))):
        if name != "alembic_version":
            found.setdefault(name, []).append(part)
    return found


def test_migrations_make_the_tables(db: Database) -> None:
    with db.read() as session:
        context = MigrationContext.configure(session.connection(), opts={"compare_type": True})
        assert compare_metadata(context, Table.metadata) == []


def test_migrations_make_the_same_checks_and_indices(db: Database, settings: Settings, store: str) -> None:
    with database_url(store) as url:
        other = unmigrated(Settings(data=settings.data / "other", database_url=url))
        with other.write() as session:
            Table.metadata.create_all(session.connection())
        with db.read() as migrated, other.read() as created:
            assert checks(migrated.connection()) == checks(created.connection())
        other.close()


def test_twice_is_once(empty: Database) -> None:
    assert upgrade(empty) is True
    assert upgrade(empty) is False
    require_current(empty)


def test_unmigrated_database_is_refused(empty: Database) -> None:
    with pytest.raises(SetupError, match=r"has no tables yet\. Run: `parenting migrate`"):
        require_current(empty)


@pytest.mark.parametrize("verb", [require_current, upgrade])
def test_newer_database_is_refused(db: Database, verb: object) -> None:
    with db.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    assert callable(verb)
    with pytest.raises(SetupError, match=r"newer version of Parenting \(revision 9999\)"):
        verb(db)


def test_tables_of_others_are_left_alone(empty: Database) -> None:
    with empty.write() as session:
        session.execute(text("CREATE TABLE run (mine INTEGER)"))
    with pytest.raises(SetupError, match="tables of another program"):
        upgrade(empty)


def test_migration_that_fails_leaves_nothing(empty: Database) -> None:
    with empty.write() as session:
        session.execute(text("CREATE TABLE answer (mine INTEGER)"))
    with pytest.raises(Exception, match="answer"):
        upgrade(empty)
    with empty.read() as session:
        assert list(checks(session.connection())) == ["answer"]


@pytest.mark.parametrize("revision", ["0001", "0002", "0003"])
def test_down_and_up_again_leads_to_the_same_tables(db: Database, mine: Claim, revision: str) -> None:
    with db.read() as session:
        before = checks(session.connection())
    downgrade(db, revision)
    with pytest.raises(SetupError, match=r"older version of Parenting\. Run: `parenting migrate`"):
        require_current(db)
    assert upgrade(db) is True
    with db.read() as session:
        assert checks(session.connection()) == before


def test_renamed_columns_keep_their_values_down_and_up(db: Database, mine: Claim) -> None:
    downgrade(db, "0003")
    with db.read() as session:
        [row] = session.execute(text("SELECT actor, epoch FROM run"))
    assert tuple(row) == (mine.worker, mine.fencing_token)
    upgrade(db)
    with db.read() as session:
        [row] = session.execute(text("SELECT worker, fencing_token FROM run"))
    assert tuple(row) == (mine.worker, mine.fencing_token)


@pytest.mark.parametrize("revision", ["the present one", "9999", "head", ""])
def test_only_an_older_revision_can_be_gone_back_to(db: Database, revision: str) -> None:
    if revision == "the present one":
        with db.read() as session:
            revision = session.execute(text("SELECT version_num FROM alembic_version")).scalar_one()
    with pytest.raises(
        SetupError, match=r"is not an older revision\. Use one of: 0001, 0002, 0003, "
    ) as said:
        downgrade(db, revision)
    listed = said.value.message.partition("Use one of: ")[2].rstrip(".").split(", ")
    assert revision not in listed


def test_revisions_are_known_without_alembic_as_it_knows_them() -> None:
    config = Config()
    config.set_main_option("script_location", str(FOLDER))
    scripts = ScriptDirectory.from_config(config).walk_revisions()
    assert known_revisions() == tuple(script.revision for script in scripts)

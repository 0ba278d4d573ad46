"""A database that is used again is as a new copy, and one whose tables were changed is not used again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psycopg
import pytest

from parenting.server.identity import database_id, renew
from parenting.server.new_run import NewRun, start
from parenting.server.runs import list_runs
from parenting.server.settings import Settings
from tests.database import database_url, migrated
from tests.postgres import Cluster


@pytest.fixture(scope="module")
def one_more() -> Iterator[Cluster]:
    """A cluster with a template of its own."""
    found = Cluster()
    found.create("template")
    with found._connected("template") as connection:
        connection.execute("CREATE TABLE kept (id serial PRIMARY KEY, word text)")
        connection.execute("INSERT INTO kept (word) VALUES ('first')")
        connection.execute("CREATE TABLE filled (id serial PRIMARY KEY, kept int REFERENCES kept)")
    yield found
    found.stop()


@pytest.fixture
def own(one_more: Cluster) -> Iterator[Cluster]:
    """The cluster, in which no other test has left a database."""
    yield one_more
    while one_more.empty:
        one_more.drop(one_more.empty.pop()[0])


def used(own: Cluster, name: str, *statements: str) -> list[Any]:
    """Make a database, do something in it, drop it: its rows at the beginning."""
    own.copy(name, "template")
    with psycopg.connect(host=str(own.folder), user="postgres", dbname=name, autocommit=True) as connection:
        kept = connection.execute("SELECT * FROM kept").fetchall()
        filled = connection.execute("INSERT INTO filled (kept) VALUES (1) RETURNING id").fetchall()
        for statement in statements:
            connection.execute(statement)
        own.drop(name)  # while somebody is connected
    return [*kept, *filled]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statement", "again"),
    [
        ("DELETE FROM filled", True),
        ("UPDATE kept SET word = 'changed'", True),
        ("INSERT INTO filled (kept) SELECT 1 FROM generate_series(1, 1000)", True),
        ("CREATE TEMPORARY TABLE passing (id int)", True),
        ("CREATE TABLE more (id int)", False),
        ("ALTER TABLE filled ADD word text", False),
        ("ALTER TABLE filled DISABLE TRIGGER ALL", False),
        ("ALTER TABLE kept ALTER word SET NOT NULL", False),
        ("DROP TABLE filled", False),
        ("REVOKE ALL ON kept FROM postgres", False),
        ("ALTER DATABASE one SET default_transaction_read_only = on", False),
        ("ALTER DATABASE one CONNECTION LIMIT 1", False),
    ],
)
def test_it_is_used_again_as_new_or_not_at_all(own: Cluster, statement: str, again: bool) -> None:
    new = [(1, "first"), (1,)]
    assert used(own, "one", statement) == new
    assert [name for name, _ in own.empty] == ["one"] * again
    assert used(own, "two") == new


@pytest.mark.slow
def test_runs_of_one_test_are_not_seen_by_the_next(tmp_path: Path) -> None:
    seen = []
    for name in ("one", "two", "three"):
        with database_url("postgresql") as url:
            db = migrated(Settings(data=tmp_path / name, database_url=url))
            assert list_runs(db) == []
            seen.append((database_id(db), start(db, NewRun(world="unsafe-exploration")).id))
            renew(db)
            db.close()
    assert seen == [seen[0]] * 3

"""The doctor looks at PostgreSQL itself; pages and workers do not start on a standby."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import text

from parenting.commands import up
from parenting.server.app import create_app
from parenting.server.db import Database, connect
from parenting.server.doctor.examination import examine
from parenting.server.doctor.findings import State
from parenting.server.doctor.server import OLDEST
from parenting.server.errors import RefusedError, SetupError
from parenting.server.migrate import upgrade
from parenting.server.settings import Settings
from parenting.server.worker_process import main
from tests.postgres import USER, Cluster, programs
from tests.tree import ROOT

pytestmark = pytest.mark.postgresql


@pytest.fixture
def server() -> Iterator[Cluster]:
    """A server as an operator has it: the one of the tests keeps nothing through a crash."""
    programs()
    own = Cluster(fsync="on", full_page_writes="on", max_connections="60")
    yield own
    own.stop()


@pytest.fixture
def settings(server: Cluster, tmp_path: Path) -> Settings:
    server.create("home")
    return Settings(data=tmp_path, database_url=server.url("home"))


def found(settings: Settings, *names: str) -> dict[str, tuple[State, str]]:
    return {one.name: (one.state, one.said) for one in examine(settings) if one.name in names}


def connections(db: Database, number: int) -> None:
    """Have a number of connections of the pool open at once."""
    held = [db.engine.connect() for _ in range(number)]
    for one in held:
        one.close()


def test_a_server_is_told_with_its_settings_and_connections(server: Cluster, settings: Settings) -> None:
    asked = ("server", "server settings", "connections")
    told = found(settings, *asked)
    assert {name: state for name, (state, _) in told.items()} == dict.fromkeys(asked, State.OK)
    assert "room for 1 of them" in told["connections"][1]
    server.admin.execute("ALTER DATABASE home SET synchronous_commit = off")
    db = connect(settings)
    connections(db, 15)
    told = found(settings, *asked)
    db.close()
    assert told["server settings"] == (
        State.ERROR,
        "synchronous_commit is off: a crash of the server loses answers that were confirmed",
    )
    assert told["connections"][0] is State.WARNING


def test_a_limit_of_the_role_or_the_database_counts(server: Cluster, settings: Settings) -> None:
    for limited in ("ROLE parenting", "DATABASE home"):
        server.admin.execute(f"ALTER {limited} CONNECTION LIMIT 20")
        state, said = found(settings, "connections")["connections"]
        assert state is State.WARNING
        assert f"1 of 20 (the CONNECTION LIMIT of the {limited.split()[0].lower()}) in use" in said
        server.admin.execute(f"ALTER {limited} CONNECTION LIMIT 0")
        told = found(settings, "database")["database"][1]
        assert told.startswith("The database takes no more connections: too many connections for")
        server.admin.execute(f"ALTER {limited} CONNECTION LIMIT -1")


def test_a_role_that_may_only_read_is_an_error(server: Cluster, settings: Settings) -> None:
    reader = Settings(data=settings.data, database_url=server.url("home").replace(f"{USER}@", "reader@"))
    server.admin.execute("CREATE ROLE reader LOGIN")
    assert found(reader, "server")["server"][1].endswith("where this role may not make tables")
    with closing(connect(settings)) as db:
        upgrade(db)
    with server._connected("home") as owner:
        owner.execute("GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader")
        state, said = found(reader, "server")["server"]
        assert state is State.ERROR
        assert "where this role may not write to access_session, " in said, said
        owner.execute("GRANT ALL ON ALL TABLES IN SCHEMA public TO reader")
        assert "may not write to access_session_id_seq, " in found(reader, "server")["server"][1]
        owner.execute("GRANT USAGE ON ALL SEQUENCES IN SCHEMA public TO reader")
    assert found(reader, "server")["server"][0] is State.OK


def test_a_standby_is_an_error_and_nothing_starts_on_it(server: Cluster, settings: Settings) -> None:
    server.admin.close()
    server._run("pg_ctl", "stop", "-m", "fast")
    signal = server.folder / "standby.signal"
    signal.touch()
    if server.user:
        shutil.chown(signal, "postgres")
    options = f"-k {server.folder} -c listen_addresses="
    server._run("pg_ctl", "start", "-w", "-l", str(server.folder / "log"), "-o", options)
    try:
        state, said = found(settings, "server")["server"]
        assert (state, "is a standby" in said) == (State.ERROR, True)
        with pytest.raises(SetupError, match=r"is a standby, which takes no answers\. Name the primary"):
            create_app(settings)
        with pytest.raises(SetupError, match="is a standby"):
            main(settings)
        with pytest.raises(SetupError, match="is a standby"):
            up._migrate(settings)
        with (
            closing(connect(settings)) as db,
            pytest.raises(RefusedError) as refused,
            db.write() as session,
        ):
            session.execute(text("CREATE TABLE more (x integer)"))
        assert "Name the primary server in PARENTING_DATABASE_URL" in refused.value.message
    finally:
        server._run("pg_ctl", "stop", "-m", "immediate")


def test_the_oldest_version_is_the_one_that_the_documentation_asks_for() -> None:
    assert f"Install PostgreSQL {OLDEST} or newer" in (ROOT / "docs" / "operations.md").read_text("utf-8")

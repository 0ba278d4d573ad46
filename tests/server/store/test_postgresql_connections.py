"""PostgreSQL's connections: one message begins a transaction, and a kept one is asked only for a reason."""

import time

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from parenting.server.db import Database, connect
from parenting.server.errors import GoneError
from parenting.server.settings import Settings
from parenting.server.store import postgresql_connections as connections
from parenting.server.store.clock import SERVER_TIME, server_mark
from parenting.server.store.patience import patience
from parenting.server.tables import Run

pytestmark = pytest.mark.only("postgresql", "connections of PostgreSQL")


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return what is sent besides the statements of SQLAlchemy."""
    found: list[str] = []
    usual = connections.said

    def said(driver: object, command: bytes) -> object:
        found.append(command.decode())
        return usual(driver, command)

    monkeypatch.setattr(connections, "said", said)
    return found


def ids(db: Database) -> list[int]:
    with db.read() as session:
        return [session.execute(text("SELECT pg_backend_pid()")).scalar_one()]


def end_all(settings: Settings) -> None:
    """Have the server end every connection to this database but the one that says so."""
    other = connect(settings)
    with other.read() as session:
        session.execute(
            text(
                "SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity "
                "WHERE pid != pg_backend_pid() AND datname = current_database()"
            )
        )
    other.close()


def test_a_transaction_begins_with_one_message(db: Database, run: Run, sent: list[str]) -> None:
    ids(db)
    with db.write():
        pass
    with db.write(durable=False):
        pass
    assert sent == [
        f"BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY; {connections.TIME}",
        "COMMIT",
        f"BEGIN ISOLATION LEVEL READ COMMITTED; {connections.TIME}",
        f"BEGIN ISOLATION LEVEL READ COMMITTED; SET LOCAL synchronous_commit = off; {connections.TIME}",
    ]


def test_nothing_begins_where_each_statement_is_to_stand_alone(db: Database, sent: list[str]) -> None:
    with db.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
        connection.execute(text("VACUUM run"))
    assert sent == []
    ids(db)
    assert sent[0].startswith("BEGIN ISOLATION LEVEL REPEATABLE READ"), "the same connection, as ever"


def test_connection_that_was_quiet_is_asked(
    db: Database, sent: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = ids(db)
    monkeypatch.setattr(connections, "QUIET_SECONDS", 0.0)
    sent.clear()
    assert ids(db) == first
    assert sent[0] == "SELECT 1"


def test_connection_that_the_server_has_ended_is_not_given_out(
    db: Database, settings: Settings, run: Run
) -> None:
    with db.read() as one, db.read() as other:  # so that the pool keeps two
        for session in (one, other):
            session.execute(text("SELECT 1"))
    before = ids(db)
    end_all(settings)
    assert ids(db) != before
    with db.read() as one, db.read() as other:
        for session in (one, other):
            assert session.execute(text("SELECT 1")).scalar_one() == 1


def test_connection_that_was_told_something_is_asked_and_goes_on(
    db: Database, settings: Settings, sent: list[str]
) -> None:
    with db.engine.connect() as connection:
        connection.execute(text("LISTEN news"))
        connection.commit()
    mine, other = ids(db), connect(settings)
    with other.write() as session:
        session.execute(text("NOTIFY news"))
    time.sleep(0.1)
    sent.clear()
    assert ids(db) == mine
    assert sent[0] == "SELECT 1"
    other.close()


def test_transaction_is_gone_with_its_connection_and_the_next_one_is_not(
    db: Database, settings: Settings, run: Run
) -> None:
    def read() -> None:
        with db.read() as session:
            connection = session.connection()
            end_all(settings)
            connection.execute(text("SELECT 1"))

    with pytest.raises(GoneError):
        read()
    assert ids(db)


def test_what_was_prepared_outlives_a_transaction_that_reads(db: Database, run: Run) -> None:
    """psycopg prepares a statement at its fifth use, and forgets all of them at a ROLLBACK."""

    def prepared() -> int:
        with db.read() as session:
            return int(session.execute(text("SELECT count(*) FROM pg_prepared_statements")).scalar_one())

    assert [prepared() for _ in range(12)][-1] > 0


def lock_ms(db: Database) -> int:
    with db.write() as session:
        shown = session.execute(text("SELECT setting FROM pg_settings WHERE name = 'lock_timeout'"))
        return int(shown.scalar_one())


def test_wait_for_a_lock_ends_with_the_patience_of_the_caller(db: Database) -> None:
    with patience(2.0):
        assert 0 < lock_ms(db) <= 2000
    assert lock_ms(db) == 5000, "the same connection, for whoever may wait"
    with patience(0.0):
        assert lock_ms(db) == 1, "0 would mean: without a limit"


def test_limit_of_the_url_is_kept(db: Database, settings: Settings) -> None:
    url = f"{settings.database_url}&options=-c%20lock_timeout%3D700ms"
    other = connect(Settings(data=settings.data, database_url=url))
    with patience(2.0):
        assert lock_ms(other) == 700
    other.close()


def server_time(session: Session) -> float:
    asked = text("SELECT CAST(extract(epoch FROM clock_timestamp()) AS double precision)")
    return float(session.execute(asked).scalar_one())


@pytest.mark.parametrize("prompt", [60.0, 0.0])
def test_time_of_the_server_goes_on_within_a_transaction(
    db: Database, monkeypatch: pytest.MonkeyPatch, prompt: float
) -> None:
    """The word that comes with BEGIN counts if it came promptly; else the server is asked."""
    monkeypatch.setattr(connections, "PROMPT_SECONDS", prompt)
    with db.read() as session:
        assert (SERVER_TIME in session.connection().info) == (prompt > 0)
        session.execute(text("SELECT pg_sleep(0.3)"))
        before, mark, after = server_time(session), server_mark(session), server_time(session)
    assert mark.epoch == "postgresql"
    assert before - 0.1 <= mark.seconds <= after + 0.1


def test_time_is_of_this_transaction_and_not_of_an_earlier_one(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "PROMPT_SECONDS", 60.0)
    with db.read() as session:
        assert SERVER_TIME in session.connection().info
        driver = session.connection().connection.dbapi_connection
    with db.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
        assert connection.connection.dbapi_connection is driver
        connection.execute(text("SELECT 1"))
        assert SERVER_TIME not in connection.info


def test_failure_within_a_read_is_told_as_it_is(db: Database, sent: list[str]) -> None:
    def read(statement: str) -> None:
        with db.read() as session:
            session.execute(text(statement))

    sent.clear()
    with pytest.raises(DBAPIError, match="nowhere"):
        read("SELECT * FROM nowhere")
    assert "COMMIT" not in sent, "there is nothing to commit"
    read("SELECT 1")
    assert "COMMIT" in sent


def test_transaction_that_cannot_begin_is_gone_in_one_sentence(
    db: Database,
    settings: Settings,
    run: Run,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """The server ended the connection as it was taken out of the pool."""
    ids(db)
    end_all(settings)
    monkeypatch.setattr(connections, "_was_told", lambda _driver: False)
    with pytest.raises(GoneError):
        ids(db)
    assert caplog.messages == []
    assert ids(db)


def test_begin_says_what_the_server_said(db: Database) -> None:
    with db.engine.connect() as connection:
        driver = connection.connection.dbapi_connection
        with pytest.raises(Exception, match="READ") as told:
            connections.said(driver, b"BEGIN READ NOTHING")
    assert type(told.value).__name__ == "SyntaxError"

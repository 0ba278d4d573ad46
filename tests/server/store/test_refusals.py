"""Errors of both drivers, and the kind of refusal that callers see (D2, D4, E12)."""

from pathlib import Path

import psycopg
import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnectionError

from parenting.server.db import Database, connect
from parenting.server.errors import (
    BusyError,
    DamagedError,
    DiskFullError,
    GoneError,
    RefusedError,
    StoreError,
)
from parenting.server.settings import Settings
from parenting.server.store.refusals import refusal, translated
from parenting.server.store.sqlite import sqlite_module


def sqlite_says(name: str) -> OperationalError:
    said = sqlite_module().OperationalError("refused")
    said.sqlite_errorname = name
    return OperationalError("INSERT", {}, said)


def postgresql_says(state: str | None) -> OperationalError:
    kind = psycopg.OperationalError if state is None else psycopg.errors.lookup(state)
    return OperationalError("INSERT", {}, kind("refused"))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("SQLITE_BUSY", BusyError),
        ("SQLITE_BUSY_SNAPSHOT", BusyError),
        ("SQLITE_LOCKED_SHAREDCACHE", BusyError),
        ("SQLITE_FULL", DiskFullError),
        ("SQLITE_IOERR_WRITE", RefusedError),
        ("SQLITE_IOERR_FSYNC", RefusedError),
        ("SQLITE_READONLY", RefusedError),
        ("SQLITE_READONLY_DIRECTORY", RefusedError),
        ("SQLITE_READONLY_DBMOVED", GoneError),
        ("SQLITE_CANTOPEN", GoneError),
        ("SQLITE_CORRUPT_INDEX", DamagedError),
        ("SQLITE_NOTADB", DamagedError),
    ],
)
def test_each_result_code_of_sqlite_has_its_kind(name: str, kind: type[StoreError]) -> None:
    assert refusal(sqlite_says(name)) is kind


@pytest.mark.parametrize(
    ("state", "kind"),
    [
        (None, GoneError),  # connection refused, or broken
        ("57P01", GoneError),  # the administrator shuts down
        ("57P03", GoneError),  # it starts
        ("08006", GoneError),
        ("40001", BusyError),
        ("40P01", BusyError),
        ("55P03", BusyError),
        ("57014", BusyError),
        ("53300", BusyError),
        ("53100", DiskFullError),
        ("25006", RefusedError),
        ("58030", RefusedError),
        ("XX001", DamagedError),
    ],
)
def test_each_state_of_postgresql_has_its_kind(state: str | None, kind: type[StoreError]) -> None:
    assert refusal(postgresql_says(state)) is kind


AT = 'connection failed: connection to server at "127.0.0.1", port 5432 failed: '


@pytest.mark.parametrize(
    ("said", "kind", "told"),
    [
        (f'{AT}FATAL:  password authentication failed for user "x"', GoneError, 'failed for user "x".'),
        (
            f'{AT}FATAL:  x\n{AT}FATAL:  no database "y"',
            GoneError,
            'no database "y".',
        ),
        ("failed to resolve host 'z': [Errno -2] Unknown", GoneError, "failed to resolve host 'z': "),
        (f"{AT}Connection refused\n\tIs the server running?", GoneError, "failed: Connection refused."),
        (f"{AT}FATAL:  starting up\nDETAIL:  Wait.", GoneError, "starting up."),
        (f"{AT}FATAL:  sorry, too many clients already", BusyError, "too many clients already."),
        (f"{AT}FATAL:  remaining connection slots are reserved", BusyError, "slots are reserved."),
        (f'{AT}FATAL:  too many connections for role "x"', BusyError, 'for role "x".'),
        ("", GoneError, "cannot be reached; nothing was stored."),
    ],
)
def test_commands_and_logs_have_the_reason_of_a_connection_that_failed(
    said: str, kind: type[StoreError], told: str
) -> None:
    with pytest.raises(kind) as refused, translated():
        raise OperationalError("", {}, psycopg.OperationalError(said))
    assert told in refused.value.message
    assert "connection failed: " not in refused.value.message
    assert refused.value.body()["error"]["message"] == kind().message, "pages keep to the general sentence"


@pytest.mark.parametrize(
    ("state", "told"),
    [("42501", "does not let its role do this: no. "), ("25006", "Name the primary server in PARENTING_")],
)
def test_a_right_that_lacks_and_a_standby_have_sentences_of_their_own(state: str, told: str) -> None:
    with pytest.raises(RefusedError) as refused, translated():
        raise psycopg.errors.lookup(state)("no\nLINE 1: INSERT")
    assert told in refused.value.message
    assert "quota" not in refused.value.message


def test_no_connection_free_in_time_is_busy() -> None:
    assert refusal(NoConnectionError("QueuePool limit")) is BusyError


@pytest.mark.parametrize(
    "error",
    [
        sqlite_says("SQLITE_ERROR"),
        postgresql_says("42601"),
        IntegrityError("INSERT", {}, psycopg.errors.UniqueViolation("twice")),
        ValueError("of somebody else"),
    ],
)
def test_what_is_not_a_refusal_passes(error: Exception) -> None:
    with pytest.raises(type(error)), translated():
        raise error


def test_file_that_is_not_a_database_is_damaged(tmp_path: Path) -> None:
    database = connect(Settings(data=tmp_path, database_url=None))
    (tmp_path / "parenting.db").write_bytes(b"This is a letter. " * 400)
    with pytest.raises(DamagedError), database.read() as session:
        session.execute(text("SELECT 1 FROM run"))
    database.close()


def test_folder_in_place_of_the_file_is_gone(tmp_path: Path) -> None:
    database = connect(Settings(data=tmp_path, database_url=None))
    (tmp_path / "parenting.db").mkdir()
    with pytest.raises(GoneError), database.read() as session:
        session.execute(text("SELECT 1"))
    database.close()


@pytest.mark.only("sqlite", "PostgreSQL has its own states above")
def test_write_of_a_database_opened_for_reading_is_refused(db: Database) -> None:
    def spoil() -> None:
        with db.write() as session:
            session.execute(text("PRAGMA query_only = on"))
            session.execute(text("DELETE FROM run"))

    with pytest.raises(RefusedError):
        spoil()

"""Lines of the log name what they are about, hide secrets, are bounded, and rotate."""

from __future__ import annotations

import json
import logging
import socket
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import httpx2
import pytest
import structlog
from sqlalchemy import text

from parenting.commands import up
from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.log import set_up_log
from parenting.server.log_lines import Limit, hidden
from parenting.server.queue.leases import lease_in
from parenting.server.settings import Settings
from parenting.server.tables import Query, Run

log = structlog.get_logger()


@pytest.fixture(autouse=True)
def log_as_before() -> Iterator[None]:
    """Logging is the process's: what a test set up is taken down."""
    root = logging.getLogger()
    handlers, level, raises = list(root.handlers), root.level, logging.raiseExceptions
    yield
    for handler in set(root.handlers) - set(handlers):
        root.removeHandler(handler)
        handler.close()
    root.setLevel(level)
    logging.raiseExceptions = raises
    structlog.reset_defaults()


def logged(settings: Settings, **more: object) -> Path:
    """Log to a file."""
    folder = settings.data / "logs"
    chosen = {"log_folder": folder, "log_format": "json", "log_level": "info", **more}
    set_up_log(settings.model_copy(update=chosen), "web")
    return folder / "web.log"


def lines(file: Path) -> list[dict[str, object]]:
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]


def test_every_line_of_a_request_names_it_and_its_run_and_question(
    settings: Settings, client: httpx2.Client, run: Run, guidance: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def told(*asked: Any) -> Query | None:
        log.info("looked")
        return lease_in(*asked)

    monkeypatch.setattr("parenting.server.api.queries.lease_in", told)
    file = logged(settings)
    reply = client.post(f"/api/v1/runs/{run.id}/queries/lease", json={"client_id": "tab"})
    looked, request = (line for line in lines(file) if line["message"] in ("looked", "request"))
    assert looked["request"] == request["request"] == reply.headers["x-request-id"]
    assert request["route"] == "/api/v1/runs/{run_id}/queries/lease"
    assert (str(looked["run"]), request["status"]) == (str(run.id), 200)
    client.post(f"/api/v1/queries/{guidance}/answer", json={"choice": "left", "client_id": "tab"})
    assert str(lines(file)[-1]["question"]) == str(guidance)
    assert client.get("/healthz").headers["x-request-id"] != reply.headers["x-request-id"]


def test_libraries_speak_the_same_way(settings: Settings) -> None:
    file = logged(settings)
    logging.getLogger("uvicorn.error").warning("Invalid HTTP %s received.", "request")
    (line,) = lines(file)
    assert (line["message"], line["level"]) == ("Invalid HTTP request received.", "warning")
    assert line["logger"] == "uvicorn.error"


def test_no_secret_is_in_it(settings: Settings, db: Database, client: httpx2.Client) -> None:
    file = logged(settings)
    log.warning(
        "one",
        url="postgresql://me:p4ss-word@host/db",
        cookie="s3ss",
        client_id="t4b",
        deep={"password": "p4ss"},
    )
    log.error("two postgresql://me:p4ss-word@host:5432/db", headers={"Authorization": "b34rer"})
    logging.getLogger("psycopg").warning("connection to password=p4ss user=me failed; client_id='t4b'")
    try:
        with db.read() as session:
            session.execute(text("SELECT :client_id FROM nowhere"), {"client_id": "t4b"})
    except Exception:
        log.exception("three")
    client.get("/", headers={"Cookie": "parent=s3ss"}, params={"client_id": "t4b"})
    written = file.read_text()
    assert [word for word in ("p4ss", "s3ss", "t4b", "b34rer") if word in written] == []
    assert written.count("me:***@host") == 2
    assert "FROM nowhere" in written


@pytest.mark.parametrize(
    "harmless", ["http://localhost:8765/runs/1", "at 12:30 run 3: the store is away", "a@b"]
)
def test_other_words_stay(harmless: str) -> None:
    assert hidden(harmless) == harmless


def test_a_warning_that_repeats_is_written_once_a_second_with_its_number() -> None:
    now = 0.0
    limit = Limit(lambda: now)

    def passes(event: str, level: int = logging.WARNING, **more: object) -> dict[str, object] | None:
        record = logging.LogRecord("x", level, "", 0, {"event": event, **more}, None, None)
        assert isinstance(record.msg, dict)
        return record.msg if limit.filter(record) else None

    assert passes("refused", code="busy", path="/a") is not None
    assert [passes("refused", code="busy", path=f"/{number}") for number in range(500)] == [None] * 500
    assert passes("refused", code="disk_full") is not None
    assert passes("run failed", run=1) is not None
    assert passes("run failed", run=2) is not None
    assert passes("request", level=logging.INFO) == passes("request", level=logging.INFO) != None  # noqa: E711
    now = 1.5
    again = passes("refused", code="busy", path="/b")
    assert again is not None
    assert again["repeated"] == 500


def test_its_memory_is_bounded_whatever_is_logged() -> None:
    now = 0.0
    limit = Limit(lambda: now)
    for number in range(5000):
        now += 0.01
        limit.filter(logging.LogRecord("x", logging.ERROR, "", 0, f"message {number}", None, None))
    assert len(limit._seen) <= 1001


def test_files_rotate_and_are_their_owners(settings: Settings) -> None:
    file = logged(settings, log_bytes=10_000, log_files=2)
    for number in range(1000):
        log.info("a line", number=number)
    found = sorted(settings.data.glob("logs/web.log*"))
    assert [one.name for one in found] == ["web.log", "web.log.1", "web.log.2"]
    assert all(one.stat().st_size <= 10_200 for one in found)
    assert {stat.S_IMODE(one.stat().st_mode) for one in found} == {0o600}
    assert lines(file)[-1]["number"] == 999


def test_two_processes_of_a_kind_have_a_file_each(settings: Settings) -> None:
    first = logged(settings)
    logged(settings)  # the lock of the first is still held, as by another process
    log.info("mine")
    assert first.read_text() == ""
    assert lines(first.with_name("web-2.log"))[0]["message"] == "mine"


def test_for_people_it_is_a_line_with_its_values(
    settings: Settings, capsys: pytest.CaptureFixture[str]
) -> None:
    set_up_log(settings, "worker")
    log.warning("run lost", run=3, reason="another worker")
    log.info("not shown")
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "warning" in said
    assert "run lost" in said
    assert "reason='another worker'" in said
    assert "run=3" in said


def test_wrong_settings_of_it_are_named(settings: Settings, tmp_path: Path) -> None:
    with pytest.raises(SetupError, match="log_level: loud"):
        set_up_log(settings.model_copy(update={"log_level": "loud"}), "web")
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", Path("/proc/x")):
        with pytest.raises(SetupError, match=f"^PARENTING_LOG_FOLDER: {folder} cannot be written to"):
            set_up_log(settings.model_copy(update={"log_folder": folder}), "web")


def test_up_tells_deaths_by_the_log(
    settings: Settings, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    killed = Mock(**{"poll.return_value": -9})
    monkeypatch.setattr("parenting.commands.children.start", lambda *_: killed)
    set_up_log(settings.model_copy(update={"log_format": "json"}), "up")
    with socket.socket() as listener, up._children(settings, listener, 1) as (web, crew, _):
        web.look()
        crew.look()
    said = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    assert [
        line["message"].partition(" process ended by itself (killed by SIGKILL)")[0] for line in said
    ] == [
        "The web",
        "The worker",
    ]

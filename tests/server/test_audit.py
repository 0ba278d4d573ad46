"""The audit log: who did what, and what was refused; strangers cannot fill it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from parenting.server import deletion, operator_events, runs
from parenting.server.app import END_SECONDS, create_app
from parenting.server.audit.acting import Actor, a_request, acting
from parenting.server.audit.entries import COLUMNS, entries
from parenting.server.audit.recording import record
from parenting.server.audit.refusals import CLIENTS, SEVERAL, Refusals
from parenting.server.audit.table import AuditEntry, Kind
from parenting.server.db import Database
from parenting.server.errors import DiskFullError
from parenting.server.public_ids import public_id
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.store.patience import remaining
from parenting.server.store.sqlite import BUSY_SECONDS
from parenting.server.tables import Run
from tests.tree import ROOT

CROSS = {"Sec-Fetch-Site": "cross-site"}


def log(db: Database) -> list[AuditEntry]:
    """All entries, the oldest first."""
    return list(reversed(entries(db, limit=200).rows))


def app_of(client: httpx2.Client) -> FastAPI:
    app: FastAPI = client.app  # type: ignore[attr-defined]
    return app


@pytest.fixture
def caller() -> Iterator[Actor]:
    """Somebody whose request is served while the test lasts."""
    with a_request("192.0.2.7") as actor:
        yield actor


def test_each_verb_of_the_operator_is_an_entry_with_who_did_it(db: Database, run: Run, caller: Actor) -> None:
    caller.who = "session k3v9"
    runs.set_status(db, run.id, RunStatus.PAUSED)
    runs.set_status(db, run.id, RunStatus.PAUSED)  # changes nothing
    runs.set_status(db, run.id, RunStatus.ACTIVE)
    runs.set_goal(db, run.id, 50)
    runs.set_pace(db, run.id, None)
    operator_events.add_operator_event(db, run.id, "change", {"name": "p_rec", "value": 0.5})
    operator_events.add_operator_event(db, run.id, "end_episode", {})
    runs.set_status(db, run.id, RunStatus.STOPPED, "Stopped by the operator.")
    runs.set_status(db, run.id, RunStatus.ACTIVE)
    deletion.begin(db, run.id)
    found = log(db)
    verbs = ["pause", "resume", "goal 50", "pace none", "change p_rec 0.5", "end episode", "stop", "resume"]
    assert [row.what for row in found] == [*verbs, f"run {run.id}"]
    assert {row.kind for row in found[:-1]} == {"operator"}
    assert found[-1].kind == "deletion"
    assert {(row.who, row.client, row.run) for row in found} == {("session k3v9", "192.0.2.7", run.public_id)}


def test_what_was_refused_by_the_run_is_not_told_as_done(db: Database, run: Run) -> None:
    runs.set_status(db, run.id, RunStatus.STOPPED)
    before = len(log(db))
    for refused in (
        lambda: runs.set_status(db, run.id, RunStatus.PAUSED),
        lambda: operator_events.add_operator_event(db, run.id, "mature", {}),
    ):
        with pytest.raises(Exception, match="run is"):
            refused()
    assert len(log(db)) == before


def test_a_request_names_its_client_and_a_command_its_user(
    client: httpx2.Client, run: Run, db: Database
) -> None:
    client.post(f"/api/v1/runs/{run.id}/pause")
    assert log(db)[-1].client == "testclient"
    assert acting().who.startswith("command line (")


def test_exports_are_entries(client: httpx2.Client, run: Run, db: Database) -> None:
    client.get(f"/api/v1/runs/{run.id}/export")
    client.get(f"/api/v1/runs/{run.id}/export", params={"of": "metrics", "format": "csv"})
    client.get("/api/v1/runs/99/export")
    assert [(row.kind, row.what) for row in log(db)] == [
        ("export", "answers as jsonl"),
        ("export", "metrics as csv"),
    ]


def test_an_export_goes_on_while_nothing_can_be_written(
    client: httpx2.Client, run: Run, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_arguments: Any, **_named: Any) -> Any:
        raise DiskFullError

    monkeypatch.setattr(db, "write", refuse)
    assert client.get(f"/api/v1/runs/{run.id}/export").status_code == 200


def test_a_hundred_refusals_are_one_entry(client: httpx2.Client, run: Run, db: Database) -> None:
    for _ in range(100):
        assert client.post(f"/api/v1/runs/{run.id}/pause", headers=CROSS).status_code == 403
    assert log(db) == []
    app_of(client).state.refusals.write()
    (row,) = log(db)
    assert (row.kind, row.what, row.client, row.count) == ("refusal", "cross_site", "testclient", 100)
    app_of(client).state.refusals.write()
    assert len(log(db)) == 1


def test_many_strangers_cause_few_entries(db: Database) -> None:
    refusals = Refusals(db)
    for number in range(5_000):
        refusals.note("plain_http", "somebody", f"2001:db8::{number:x}")
    refusals.note("cross_site", "somebody", "192.0.2.1")
    refusals.write()
    found = log(db)
    assert len(found) == CLIENTS + 2
    assert sum(row.count for row in found) == 5_001
    assert {row.what for row in found if row.who == SEVERAL} == {"plain_http", "cross_site"}


def test_refusals_that_cannot_be_written_are_counted_on(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_arguments: Any, **_named: Any) -> Any:
        raise DiskFullError

    refusals = Refusals(db)
    refusals.note("cross_site", "somebody", "192.0.2.1")
    with monkeypatch.context() as patched:
        patched.setattr(db, "write", refuse)
        refusals.write()
    refusals.note("cross_site", "somebody", "192.0.2.1")
    refusals.write()
    assert [row.count for row in log(db)] == [2]


def test_nothing_in_the_program_changes_or_deletes_an_entry() -> None:
    """Only the module that adds, the two that read and the table itself name the class."""
    named = {
        str(path.relative_to(ROOT))
        for folder in ("server", "commands", "library")
        for path in Path(ROOT, folder).rglob("*.py")
        if "AuditEntry" in path.read_text("utf-8")
    }
    audit = {f"server/audit/{name}.py" for name in ("entries", "recording", "refusals", "table")}
    assert named == {*audit, "server/api/audit.py", "server/tables.py"}
    texts = [Path(ROOT, name).read_text("utf-8") for name in named - {"server/tables.py"}]
    assert not any(verb in text for verb in ("update(", "delete(", "merge(") for text in texts)


def fill(db: Database, number: int) -> None:
    with db.write() as session:
        for each in range(number):
            record(db, session, Kind.OPERATOR if each % 2 else Kind.EXPORT, f"=pace {each}", public_id())


def test_the_api_reads_it_page_by_page_and_by_kind(client: httpx2.Client, db: Database) -> None:
    fill(db, 7)
    seen, before = [], None
    while True:
        given = {"limit": 3} | ({"before": before} if before else {})
        reply = client.get("/api/v1/audit", params=given).json()
        seen += [row["id"] for row in reply["rows"]]
        if (before := reply["next"]) is None:
            break
    assert seen == [7, 6, 5, 4, 3, 2, 1]
    exported = client.get("/api/v1/audit", params={"kind": "export"}).json()["rows"]
    assert [row["what"] for row in exported] == ["=pace 6", "=pace 4", "=pace 2", "=pace 0"]
    assert client.get("/api/v1/audit", params={"kind": "gossip"}).status_code == 422


def test_it_leaves_whole_as_csv_without_formulas(client: httpx2.Client, db: Database) -> None:
    fill(db, 3)
    reply = client.get("/api/v1/audit/export")
    assert reply.headers["content-disposition"] == 'attachment; filename="audit.csv"'
    head, *rows = csv.reader(io.StringIO(reply.text))
    assert tuple(head) == COLUMNS
    assert [row[3] for row in rows] == ["'=pace 0", "'=pace 1", "'=pace 2"]


def test_one_kind_leaves_as_csv(client: httpx2.Client, db: Database) -> None:
    fill(db, 3)
    told = {kind: client.get("/api/v1/audit/export", params={"kind": kind}) for kind in Kind}
    rows = [row for reply in told.values() for row in list(csv.reader(io.StringIO(reply.text)))[1:]]
    assert sorted(int(row[0]) for row in rows) == [entry.id for entry in log(db)]
    assert all(row[2] == kind for kind in Kind for row in list(csv.reader(io.StringIO(told[kind].text)))[1:])
    assert client.get("/api/v1/audit/export", params={"kind": "gossip"}).status_code == 422


def test_a_locked_store_holds_up_the_end_for_a_second_at_most(
    settings: Settings, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    allowed: list[float] = []
    monkeypatch.setattr(Refusals, "write", lambda _self: allowed.append(remaining(BUSY_SECONDS)))
    with TestClient(create_app(settings, db)):
        pass
    assert len(allowed) == 1
    assert allowed[0] <= END_SECONDS


def test_its_page_shows_the_newest_and_leads_to_older_ones(client: httpx2.Client, db: Database) -> None:
    assert "Nothing has happened yet." in client.get("/audit").text
    fill(db, 60)
    newest = client.get("/audit").text
    assert "Operated a run: =pace 59" in newest
    assert "=pace 9<" not in newest
    assert 'href="/audit?before=11"' in newest
    older = client.get("/audit", params={"before": 11, "kind": "operator"}).text
    assert "Operated a run: =pace 9" in older
    assert "Exported" not in older.partition("<table")[2]


@pytest.mark.only("sqlite", "PostgreSQL keeps the types of columns")
def test_a_damaged_entry_hides_no_other(client: httpx2.Client, db: Database) -> None:
    fill(db, 2)
    with db.engine.begin() as connection:
        connection.exec_driver_sql("UPDATE audit SET created = 'x' WHERE id = 1")
    assert client.get("/api/v1/audit").json()["rows"][1].keys() == {"id", "damaged"}
    assert "Entry 1 is damaged" in client.get("/audit").text
    assert client.get("/api/v1/audit/export").text.count("\n") == 3

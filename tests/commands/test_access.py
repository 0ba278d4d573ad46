"""`parenting access`: its commands make, list and end what lets browsers and programs in."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.server.access import sessions, tokens
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start


def access(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["access", *arguments])


def test_an_address_lets_a_browser_in(db: Database) -> None:
    said = access("open").stdout
    address, _, secret = said.strip().partition("?token=")
    assert address == "http://localhost:8765/open"
    assert sessions.enter(db, secret).session.role == "researcher"
    assert access("open", "--url", "https://lab.example/").stdout.startswith(
        "https://lab.example/open?token=po_"
    )


def test_the_address_of_a_public_server_is_that_of_its_proxy(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARENTING_HOSTS", "lab.example")
    assert access("open").stdout.startswith("http://localhost:8765/open?token=")
    monkeypatch.setenv("PARENTING_PUBLIC", "true")
    for made in (("open",), ("create", "link", "--role", "viewer")):
        assert access(*made).stdout.startswith("https://lab.example/open?token="), made


def test_links_and_tokens_are_made_listed_and_ended(db: Database) -> None:
    start(db, NewRun(world="unsafe-exploration"))
    assert access().stdout.startswith("Nobody may come in by a browser yet.")
    made = access("create", "link", "--run", "1", "--name", "seat 1", "--days", "3")
    assert made.exit_code == 0, made.output
    secret = made.stdout.strip().partition("/open?token=")[2]
    assert sessions.enter(db, secret).session.run_id == 1
    program = json.loads(access("create", "token", "--role", "viewer", "--json").stdout)
    assert program["token"].startswith("pt_")
    told = json.loads(access("list", "--json").stdout)
    assert [(one["kind"], one["role"], one["run"], one["name"], one["state"]) for one in told] == [
        ("program", "viewer", None, None, "valid"),
        ("link", "parent", 1, "seat 1", "valid"),
        ("session", "parent", 1, "seat 1", "valid"),
    ]
    assert "seat 1" in access("list").stdout
    assert access("revoke", told[1]["id"]).stdout == f"Ended: {told[1]['id']}.\n"
    assert [one["kind"] for one in json.loads(access("--json").stdout)] == ["program"]
    states = [one["state"] for one in json.loads(access("list", "--all", "--json").stdout)]
    assert states == ["valid", "revoked", "revoked"]
    assert secret not in access("list", "--all", "--json").stdout


def test_all_sessions_end(db: Database) -> None:
    sessions.enter(db, access("open").stdout.strip().partition("?token=")[2])
    assert access("revoke", "--sessions").stdout == "All sessions are ended.\n"
    assert sessions.list_sessions(db) == []


def test_what_is_wrong_is_said(db: Database) -> None:
    for arguments, sentence in (
        (["revoke"], "ID: name what to end, or --sessions."),
        (["revoke", "nobody"], "There is no token and no session nobody."),
        (["create", "link"], "run: Name the run that the parent answers."),
        (["create", "link", "--run", "7"], "There is no run 7."),
        (["create", "token", "--days", "5000"], "days: Write a number above 0 and up to 3660."),
        (["create", "token", "--name", "\x00"], "--name: "),
    ):
        said = access(*arguments)
        assert (said.exit_code, said.stderr.startswith(sentence)) == (2, True), said.output
    assert tokens.list_tokens(db) == []

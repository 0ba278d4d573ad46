"""A PostgreSQL database is dumped, checked and restored by PostgreSQL's own tools."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest
from sqlalchemy import make_url

from parenting.server.access import tokens
from parenting.server.access.roles import Role
from parenting.server.backups import dumps
from parenting.server.backups.in_use import require_unconnected
from parenting.server.backups.making import back_up
from parenting.server.backups.restoring import restore
from parenting.server.db import Database, connect
from parenting.server.errors import SetupError
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import answer
from parenting.server.runs import list_runs
from parenting.server.settings import Settings

pytestmark = pytest.mark.only("postgresql", "SQLite's files are copied: test_copies.py")


def worlds(settings: Settings) -> list[str]:
    db = connect(settings)
    try:
        return sorted(run.world for run in list_runs(db, 10))
    finally:
        db.close()


def are_ended(settings: Settings, name: str) -> bool:
    """Return whether the only token that there was is ended."""
    db = connect(settings)
    try:
        return [one.public_id for one in tokens.list_tokens(db, all_of_them=True) if one.revoked] == [name]
    finally:
        db.close()


@pytest.mark.slow
def test_a_dump_brings_the_database_back_and_the_former_one_is_kept(
    settings: Settings, db: Database, guidance: int, tmp_path: Path
) -> None:
    answer(db, guidance, "left", "tab", "human")
    link = tokens.make(db, "link", Role.VIEWER)
    made = back_up(settings, tmp_path / "monday.dump")
    assert stat.S_IMODE(made.file.stat().st_mode) == 0o600
    start(db, NewRun(world="reward-hacking", parent="scripted"))
    with pytest.raises(SetupError, match=r"in use: \d+ connections?"):
        restore(settings, made.file, replace=True)
    db.close()
    with pytest.raises(SetupError, match=r"holds tables\. Give --replace"):
        restore(settings, made.file)
    done = restore(settings, made.file, replace=True)
    assert worlds(settings) == ["unsafe-exploration"]
    assert are_ended(settings, link.token.public_id)
    assert done.aside is not None
    restore(settings, done.aside, replace=True)
    assert worlds(settings) == ["reward-hacking", "unsafe-exploration"]


def test_a_dump_that_is_cut_off_is_refused_and_changes_nothing(
    settings: Settings, db: Database, guidance: int, tmp_path: Path
) -> None:
    made = back_up(settings, tmp_path / "monday.dump").file
    made.write_bytes(made.read_bytes()[:200])
    db.close()
    with pytest.raises(SetupError, match="pg_restore failed"):
        restore(settings, made, replace=True)
    assert worlds(settings) == ["unsafe-exploration"]


def test_without_the_tool_the_command_is_told_without_its_password(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("parenting.server.backups.dumps.shutil.which", lambda _: None)
    url = make_url("postgresql+psycopg://me:p4ss@there:5433/parenting?sslmode=require")
    with pytest.raises(SetupError, match="pg_dump is not installed here") as refused:
        dumps.dump(url, tmp_path / "x")
    told = refused.value.message
    assert "PGHOST=there PGPORT=5433 PGUSER=me PGDATABASE=parenting PGSSLMODE=require pg_dump" in told
    assert "p4ss" not in told
    assert dumps.environment(url)["PGPASSWORD"] == "p4ss"


def test_the_reason_of_a_tool_is_its_error_and_not_what_it_was_at(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    told = "pg_restore: while PROCESSING TOC:\npg_restore: error: permission denied for schema public\nmore\n"
    (tmp_path / "pg_restore").write_text(f"#!/bin/sh\nprintf '{told}' >&2\nexit 1\n")
    (tmp_path / "pg_restore").chmod(0o700)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    with pytest.raises(
        SetupError, match="pg_restore failed: pg_restore: error: permission denied for schema"
    ):
        dumps.restore(make_url("postgresql://me@there/x"), tmp_path / "x.dump")


def test_a_restore_into_a_database_that_is_away_has_the_reason(tmp_path: Path) -> None:
    url = make_url("postgresql://me:p4ss@127.0.0.1:1/x")
    with pytest.raises(SetupError, match=r"me:\*\*\*@.* cannot be reached: .*failed: Connection refused\.$"):
        require_unconnected(url)

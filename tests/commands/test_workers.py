"""`parenting workers`: who raises how many runs, at what load."""

from __future__ import annotations

import json

from sqlalchemy import text
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.settings import Settings
from parenting.server.worker import Worker
from parenting.server.workers import Figures, sign


def listed(*arguments: str) -> list[str]:
    said = CliRunner().invoke(app, ["workers", *arguments])
    assert said.exit_code == 0, said.output
    return [line.rstrip() for line in said.stdout.splitlines() if line.strip(" ─")]


def test_without_any_it_says_how_one_is_started(db: Database) -> None:
    assert listed() == ["No worker is alive. Start one: `parenting worker`"]
    assert listed("--json") == ["[]"]


def test_each_tells_its_runs_load_and_memory(db: Database) -> None:
    sign(db, "here:1", Figures(12, 3, 0.25, 300_000_000, 0.04))
    sign(db, "older:2")
    head, here, older = listed()
    assert head.split() == ["worker", "since", "runs", "in", "memory", "load", "memory", "waited"]
    assert here.split()[-7:] == ["12", "3", "25%", "300", "MB", "40", "ms"]
    assert older.startswith("older:2")
    assert json.loads(listed("--json")[0])[0]["waited"] == 0.04


def test_a_damaged_figure_costs_itself_alone(db: Database) -> None:
    sign(db, "here:1", Figures(12, 3, 0.25, 300_000_000, 0.04))
    with db.write() as session:
        session.execute(text("UPDATE worker SET busy = 'much', started = 'once'"))
    assert listed()[1].split() == ["here:1", "12", "3", "300", "MB", "40", "ms"]


def test_a_worker_says_how_it_is(db: Database, settings: Settings) -> None:
    for _ in range(3):
        start(db, NewRun(world="unsafe-exploration", config={"p_pref": 0.0}))
    worker = Worker(db, settings)
    worker._go_on()
    worker._go_on()
    worker.signs.give()
    (said,) = json.loads(listed("--json")[0])
    assert (said["name"], said["runs"], said["lives"]) == (worker.name, 3, 3)
    assert said["memory"] > 50_000_000
    assert said["busy"] > 0
    worker._close()
    assert listed("--json") == ["[]"]

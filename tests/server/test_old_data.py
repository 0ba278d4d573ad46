"""A data folder written by version 0.1.0 opens, exports the same values, and goes on with the same bits."""

from __future__ import annotations

import hashlib
import json
import re
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch
from fastapi.testclient import TestClient
from sqlalchemy import text
from torch import Tensor
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server import runs
from parenting.server.app import create_app
from parenting.server.archive.format1 import read_table
from parenting.server.archive.format1_import import import_table
from parenting.server.db import Database, connect
from parenting.server.errors import NotFound, SetupError
from parenting.server.export import lines
from parenting.server.exports import Part, exported
from parenting.server.migrate import require_current, upgrade
from parenting.server.new_run import NewRun
from parenting.server.operator_events import add_operator_event
from parenting.server.queue import answers, leases, worker_side
from parenting.server.replay import relive
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.snapshot import changed, versions
from tests.access import seed
from tests.tree import ROOT

OLD = ROOT / "tests/old/0.1.0"
EXPECTED = json.loads((OLD / "expected.json").read_text())
RUNS = (1, 2, 3)
WRITTEN_WITH = ("AVX2", "AVX512")
"""Instructions of torch with the same bits as those that wrote the sample."""
NAMES = ["database", "run_public_id", "query_public_id", "guidance_layout", "practice", "words", "remarks"]
NAMES += ["votes", "script", "leased", "replays", "reason", "effects"]
"""The keys that later versions add to a row of the export."""
SAME = ("number", "kind", "tick", "applied_tick", "policy", "left", "right", "choice", "received", "standing")
"""The keys that are the same of a run that was imported from its table."""
PAGES = ("/runs/{}", "/runs/{}/parent", "/runs/{}/history", "/runs/{}/why", "/api/v1/runs/{}/queries")


@pytest.fixture
def settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Settings:
    with tarfile.open(OLD / "data.tar.xz") as archive:
        archive.extractall(tmp_path, filter="data")
    seed(tmp_path / "data")
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path / "data"))
    return Settings(data=tmp_path / "data", database_url=None)


@pytest.fixture
def unmigrated(settings: Settings) -> Iterator[Database]:
    database = connect(settings)
    yield database
    database.close()


@pytest.fixture
def db(unmigrated: Database) -> Database:
    upgrade(unmigrated)
    return unmigrated


@pytest.fixture
def same_build(db: Database) -> None:
    """Other builds of torch and other instructions give other bits: there is nothing to compare."""
    if torch.backends.cpu.get_cpu_capability() not in WRITTEN_WITH:
        pytest.skip(f"the sample was written with one of {WRITTEN_WITH}")
    there = runs.get_run(db, 1).versions
    if changed(there, versions()):
        pytest.skip(f"the sample was written with {there}; here is {versions()}")


def test_it_is_refused_until_its_tables_are_brought_up_to_date(unmigrated: Database) -> None:
    with pytest.raises(SetupError, match=r"older version of Parenting\. Run: `parenting migrate`"):
        require_current(unmigrated)
    assert upgrade(unmigrated) is True
    require_current(unmigrated)


def test_the_way_back_leads_to_the_tables_of_the_old_version(unmigrated: Database) -> None:
    def tables() -> list[tuple[str, str]]:
        with unmigrated.read() as session:
            rows = session.execute(text("SELECT name, sql FROM sqlite_schema WHERE sql IS NOT NULL"))
            return sorted((row[0], "".join(row[1].split())) for row in rows)

    before = tables()
    upgrade(unmigrated)
    assert tables() != before
    page = (ROOT / "docs/deployment.md").read_text(encoding="utf-8")
    (command,) = re.findall(r"^\| 0\.1\.0 \| `parenting (migrate --to \d+)` \|$", page, re.M)
    said = CliRunner().invoke(app, command.split())
    assert (said.exit_code, said.stdout) == (0, "The database is at revision 0003 now.\n"), said.output
    assert tables() == before


def test_the_commands_list_it(db: Database) -> None:
    found = json.loads(CliRunner().invoke(app, ["runs", "--json"]).stdout)
    names = ["no checkpoint yet", "half answered", "finished"]
    assert [run["name"] for run in found] == names
    assert [run["state"] for run in found] == ["question", "question", "over"]
    assert [run["tick"] for run in found] == [12, 44, 28]


@pytest.mark.parametrize("run", RUNS)
def test_its_export_has_the_old_bytes_and_the_names(db: Database, settings: Settings, run: int) -> None:
    old = (settings.data / f"run-{run}.jsonl").read_text(encoding="utf-8")
    assert old.count("\n") == runs.get_run(db, run).answers > 0
    for line, before in zip(lines(db, run), old.splitlines(), strict=True):
        assert line.startswith(before.removesuffix("}") + ","), "the old keys first, to the byte"
        assert list(json.loads(line))[len(json.loads(before)) :] == NAMES


@pytest.mark.slow_after(4)
@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    "path", ["/runs/{}", "/runs/{}/parent", "/runs/{}/history", "/runs/{}/why", "/api/v1/runs/{}/queries"]
)
def test_its_pages_open(db: Database, settings: Settings, path: str, run: int) -> None:
    with TestClient(create_app(settings, db), base_url="http://localhost") as client:
        page = client.get(path.format(run), follow_redirects=True)
    assert page.status_code == 200, page.text
    assert "went wrong" not in page.text


def test_a_question_of_the_old_version_is_leased_and_answered(db: Database, settings: Settings) -> None:
    with TestClient(create_app(settings, db), base_url="http://localhost") as client:
        question = client.post("/api/v1/runs/2/queries/lease", json={"client_id": "new-tab"})
        assert question.status_code == 200, question.text
        body = {"choice": "left", "client_id": "new-tab"}
        stored = client.post(f"/api/v1/queries/{question.json()['id']}/answer", json=body)
    assert stored.json()["number"] == 17


@pytest.mark.parametrize("run", [1, 2])
def test_it_is_replayed_to_the_same_bits(db: Database, same_build: None, run: int) -> None:
    found = relive(db, run)
    assert (found.parted, list(found.differ)) == (None, [])
    assert found.tick == {1: 28, 2: 13}[run]


def test_without_a_checkpoint_there_is_nothing_to_compare(db: Database) -> None:
    with pytest.raises(NotFound, match="Run 3 has no checkpoint yet"):
        relive(db, 3)


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("run", [2, 3])
def test_it_goes_on_with_the_bits_of_the_old_version(db: Database, same_build: None, run: int) -> None:
    expected = EXPECTED[str(run)]
    mine = {claim.run_id: claim for claim in runs.claim(db, "worker", -1)}[run]
    session = RunSession(db, mine, runs.get_run(db, run), lambda: None)
    while session.last_tick < expected["tick"]:
        seen = worker_side.watch(db, [run])[run]
        if session.ready(seen):
            session.tick(seen)
        elif bool(session.saved.state.all_refused):
            add_operator_event(db, run, "end_episode", {})
        else:
            query = leases.lease(db, run, "tab")
            assert query is not None
            answers.answer(db, query.id, "left", "tab", "human")
    state = session.saved.state
    assert runs.get_run(db, run).answers == expected["answers"]
    assert digest(state.learner.params) == expected["parameters"]
    assert digest(state.familiarity) == expected["familiarity"]


@pytest.mark.parametrize("run", RUNS)
def test_its_table_of_answers_is_a_run_again(
    db: Database, same_build: None, settings: Settings, tmp_path: Path, run: int
) -> None:
    was, log = runs.get_run(db, run), tmp_path / "log.jsonl"
    log.write_text("".join(exported(db, run, Part.EVENTS)))
    table = read_table(settings.data / f"run-{run}.jsonl", log)
    kept: dict[str, Any] = {"world": was.world, "parent": was.parent, "seed": was.seed, "config": was.config}
    found = import_table(db, table, NewRun(**kept, level_text=was.level_text))
    rows = [[json.loads(line) for line in lines(db, number)] for number in (run, found.number)]
    assert [{k: row[k] for k in SAME} for row in rows[1]] == [{k: row[k] for k in SAME} for row in rows[0]]
    assert worker_side.high_water(db, found.number) == table.last


def digest(tensor: Tensor) -> str:
    return hashlib.sha256(tensor.contiguous().numpy().tobytes()).hexdigest()

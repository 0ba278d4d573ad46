"""So many runs may live, in all and of one client, and no more."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import httpx2
import pytest
from fastapi.testclient import TestClient
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.app import create_app
from parenting.server.db import Database, connect
from parenting.server.new_run import NewRun, start
from parenting.server.runs import list_runs, set_status
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus

RUN = {"world": "unsafe-exploration"}
AT_ONCE = 8


def client(db: Database, settings: Settings, **limits: int) -> TestClient:
    return TestClient(create_app(settings.model_copy(update=limits), db), base_url="http://localhost")


def refused(reply: httpx2.Response, setting: str) -> None:
    assert reply.status_code == 409
    error = reply.json()["error"]
    assert error["code"] == "too_many_runs"
    assert error["message"].startswith("2 runs ")
    assert error["message"].endswith(f"raise {setting}.")


@pytest.mark.parametrize(
    ("limits", "setting"),
    [({"runs": 2}, "PARENTING_RUNS"), ({"runs_per_client": 2}, "PARENTING_RUNS_PER_CLIENT")],
)
def test_one_more_is_refused_until_one_is_over(
    db: Database, settings: Settings, limits: dict[str, int], setting: str
) -> None:
    web = client(db, settings, **limits)
    for _ in range(2):
        assert web.post("/api/v1/runs", json=RUN).status_code == 201
    refused(web.post("/api/v1/runs", json=RUN), setting)
    assert web.post("/runs", data=RUN, follow_redirects=False).status_code == 409
    assert len(list_runs(db)) == 2, "nothing was started"
    set_status(db, 1, RunStatus.STOPPED)
    assert web.post("/api/v1/runs", json=RUN).status_code == 201
    refused(web.post("/api/v1/runs", json=RUN), setting)


def test_one_that_goes_on_or_begins_from_another_counts_as_well(db: Database, settings: Settings) -> None:
    web = client(db, settings, runs=2)
    for _ in range(2):
        assert web.post("/api/v1/runs", json=RUN).status_code == 201
    refused(web.post("/api/v1/runs/1/roll-back", json={"tick": 0}), "PARENTING_RUNS")
    assert web.post("/runs/1/roll-back", data={"roll_back": "0"}, follow_redirects=False).status_code == 409
    set_status(db, 1, RunStatus.STOPPED)
    assert web.post("/api/v1/runs", json=RUN).status_code == 201
    refused(web.post("/api/v1/runs/1/resume"), "PARENTING_RUNS")
    assert web.post("/runs/1/status", data={"status": "active"}, follow_redirects=False).status_code == 409
    assert [(run.id, run.status) for run in list_runs(db)] == [(3, "active"), (2, "active"), (1, "stopped")]
    assert web.post("/api/v1/runs/2/pause").status_code == 200
    assert web.post("/api/v1/runs/2/resume").status_code == 200, "a paused one lives already"
    set_status(db, 2, RunStatus.STOPPED)
    assert web.post("/api/v1/runs/1/resume").status_code == 200


def test_commands_keep_to_the_limit_of_all(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(settings.data))
    monkeypatch.setenv("PARENTING_DATABASE_URL", settings.url)
    monkeypatch.setenv("PARENTING_RUNS", "1")
    one = start(db, NewRun(world="unsafe-exploration")).id
    said = CliRunner().invoke(app, ["rollback", str(one), "--to", "0"])
    assert (said.exit_code, "1 runs live" in said.stderr) == (2, True)
    set_status(db, one, RunStatus.STOPPED)
    start(db, NewRun(world="unsafe-exploration"))
    said = CliRunner().invoke(app, ["resume", str(one)])
    assert (said.exit_code, "1 runs live" in said.stderr) == (2, True)


def test_runs_that_a_client_begins_from_others_are_its_own(db: Database, settings: Settings) -> None:
    web = client(db, settings, runs_per_client=2)
    assert web.post("/api/v1/runs", json=RUN).status_code == 201
    assert web.post("/api/v1/runs/1/roll-back", json={"tick": 0}).status_code == 201
    refused(web.post("/api/v1/runs/1/roll-back", json={"tick": 0}), "PARENTING_RUNS_PER_CLIENT")


def test_the_runs_of_others_count_for_nobody_else(db: Database, settings: Settings) -> None:
    web = client(db, settings, runs_per_client=2)
    other = TestClient(web.app, base_url="http://localhost", client=("192.0.2.7", 5000))
    for one in (web, other, web, other):
        assert one.post("/api/v1/runs", json=RUN).status_code == 201
    refused(other.post("/api/v1/runs", json=RUN), "PARENTING_RUNS_PER_CLIENT")


def begun(person: TestClient) -> int:
    """Ask for a run, again and again while the store has no turn for it."""
    while (code := person.post("/api/v1/runs", json=RUN).status_code) == 503:
        pass
    return code


@pytest.mark.parametrize("limits", [{"runs": 3}, {"runs_per_client": 3}])
def test_two_at_once_cannot_both_take_the_last_place(
    db: Database, settings: Settings, limits: dict[str, int]
) -> None:
    """The limit of all holds over two web processes as well; that of a client is each one's own."""
    with closing(connect(settings)) as other, ThreadPoolExecutor(AT_ONCE) as pool:
        apps = [client(one, settings, **limits).app for one in (db, other)]
        webs = apps if "runs" in limits else apps[:1]
        people = [TestClient(webs[n % len(webs)], base_url="http://localhost") for n in range(AT_ONCE)]
        found = list(pool.map(begun, people))
    assert sorted(found) == [201] * 3 + [409] * (AT_ONCE - 3)
    assert len(list_runs(db)) == 3

"""Every route: what it gives, what it refuses, and in which words."""

from typing import Any

import httpx2
import pytest

from parenting.agent.config import Config
from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.log import set_up_log
from parenting.server.metrics import write_metrics
from parenting.server.progress import report_progress
from parenting.server.queue.worker_side import take_operator_events
from parenting.server.runs import Claim, get_run
from parenting.server.settings import Settings
from parenting.server.tables import Run
from tests.server.conftest import Clock

WORLD = "unsafe-exploration"
OWN = "WWWWW\nWA GW\nWWWWW"


def wrong(reply: httpx2.Response, status: int = 422) -> dict[str, str]:
    """The fields that an error names, with their messages."""
    assert reply.status_code == status
    error = reply.json()["error"]
    assert error["message"]
    return {found["field"]: found["message"] for found in error.get("fields", [])}


def start(client: httpx2.Client, **fields: Any) -> httpx2.Response:
    return client.post("/api/v1/runs", json={"world": WORLD, **fields})


def test_start_a_run(client: httpx2.Client, db: Database) -> None:
    fields = {"preset": "lax", "config": {"p_rec": 0.25, "stages": 2.0}, "seed": 7, "name": "first"}
    made = start(client, parent="scripted", **fields)
    assert made.status_code == 201
    shown = made.json()
    assert (shown["world"], shown["level"], shown["seed"], shown["status"]) == (WORLD, "island", 7, "active")
    assert (shown["name"], shown["parent"], shown["worker"]) == ("first", "scripted", "silent")
    stored = get_run(db, shown["id"])
    config = Config(**stored.config)
    assert (config.p_guid, config.p_rec, config.max_clip_length) == (0.5, 0.25, 2)
    assert config.gamma == registry.defaults(WORLD)["gamma"]
    assert stored.legend == dict(registry.spec(WORLD).legend)
    assert registry.level(WORLD, stored.level_text).rows == registry.level(WORLD, "island").rows


def test_what_it_begins_with(client: httpx2.Client) -> None:
    assert start(client).json()["weights"] is None
    shown = start(client, world="absent-supervisor", config={"supervised": "random"}).json()
    assert len(shown["weights"]) == 64
    assert (shown["config"]["supervised"], shown["config"]["pretrain"]) == ("random", True)


def test_conservative_comes_first(client: httpx2.Client) -> None:
    shown = start(client).json()
    assert (shown["preset"], shown["config"]["p_guid"], shown["seed"]) == ("conservative", 0.95, 0)


def test_setting_of_the_run_goes_before_the_worlds(client: httpx2.Client) -> None:
    assert start(client, config={"gamma": 0.5}).json()["config"]["gamma"] == 0.5


@pytest.mark.parametrize("text", [OWN, OWN + "\n", OWN.replace("\n", "\r\n"), "name: mine\n\n" + OWN])
def test_level_of_ones_own(client: httpx2.Client, db: Database, text: str) -> None:
    made = start(client, level_text=text)
    assert made.status_code == 201
    assert registry.level(WORLD, get_run(db, made.json()["id"]).level_text).rows == (
        "WWWWW",
        "WA GW",
        "WWWWW",
    )


@pytest.mark.only("sqlite", "refused before a store is asked")
@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ({"world": "mars"}, {"world": "There is no such world"}),
        ({"level": "atoll"}, {"level": "island, island-bottleneck"}),
        ({"level": "island", "level_text": OWN}, {"level": "not both"}),
        ({"level_text": "WWW\nWAW"}, {"level_text": "line 1, column 1"}),
        ({"level_text": "WWW"}, {"level_text": "line 1"}),
        ({"preset": "strict"}, {"preset": "conservative, lax, direct"}),
        ({"parent": "nobody"}, {"parent": "'human' or 'scripted'"}),
        ({"seed": -1}, {"seed": "greater than or equal to 0"}),
        ({"seed": 2**53}, {"seed": "less than or equal to"}),
        ({"seed": True}, {"seed": "valid integer"}),
        ({"seed": "1"}, {"seed": "valid integer"}),
        ({"seed": 1.5}, {"seed": "valid integer"}),
        ({"name": "a\u0007b"}, {"name": "control character U+0007"}),
        ({"name": "a\nb"}, {"name": "Write one line"}),
        ({"name": "x" * 101}, {"name": "at most 100"}),
        ({"level_text": OWN + "\u0000"}, {"level_text": "control character U+0000"}),
        ({"level_text": "W" * 9000}, {"level_text": "at most 8192"}),
        ({"config": {"p_guid": 1.5}}, {"config.p_guid": "less than or equal to 1"}),
        ({"config": {"p_guid": True}}, {"config.p_guid": "valid number"}),
        ({"config": {"p_guid": "0.5"}}, {"config.p_guid": "valid number"}),
        ({"config": {"stages": 1.5}}, {"config.stages": "valid integer"}),
        ({"config": {"max_clip_length": 1.5}}, {"config.max_clip_length": "valid integer"}),
        ({"config": {"max_clip_length": 2, "stages": 2}}, {"config": "max_clip_length and stages are two"}),
        ({"config": {"p_gide": 1}}, {"config.p_gide": "not permitted"}),
        ({"config": {"p_guid": [1]}}, {"config.p_guid": ""}),
        ({"config": 3}, {"config": "valid dictionary"}),
        ({"color": "red"}, {"color": "not permitted"}),
        ({"preset": "x", "world": "y", "seed": 0}, {"world": "no such world", "preset": "no such preset"}),
        ({"seed": -1, "parent": "x"}, {"seed": "", "parent": ""}),
    ],
)
def test_each_wrong_field_gets_its_message(
    client: httpx2.Client, db: Database, fields: dict[str, Any], named: dict[str, str]
) -> None:
    found = wrong(start(client, **fields))
    assert found.keys() == named.keys()
    assert all(part in found[field] for field, part in named.items())


def test_list_runs(client: httpx2.Client) -> None:
    first, second = start(client).json(), start(client).json()
    listed = client.get("/api/v1/runs").json()
    assert listed == {"rows": [second, first], "next": None, "database": first["database"]}
    assert client.get(f"/api/v1/runs/{first['id']}").json() == first


def test_run_shows_where_it_is(
    client: httpx2.Client, db: Database, mine: Claim, guidance: int, clock: Clock
) -> None:
    report_progress(db, mine, tick=5, waiting="guidance")
    shown = client.get(f"/api/v1/runs/{mine.run_id}").json()
    assert (shown["tick"], shown["waiting"], shown["worker"]) == (5, "guidance", "alive")
    assert shown["open"] == {"guidance": 1, "preference": 0}
    clock.pass_seconds(6)
    assert client.get(f"/api/v1/runs/{mine.run_id}").json()["worker"] == "silent"


def test_pause_resume_stop(client: httpx2.Client, run: Run) -> None:
    def post(verb: str) -> httpx2.Response:
        return client.post(f"/api/v1/runs/{run.id}/{verb}")

    assert post("pause").json()["status"] == "paused"
    assert post("resume").json()["status"] == "active"
    assert post("stop").json()["status"] == "stopped"
    assert post("stop").json()["worker"] == "done"
    refused = post("pause")
    assert refused.status_code == 409
    assert refused.json()["error"]["code"] == "conflict"
    assert post("mature").status_code == 409
    assert post("resume").json()["status"] == "active"


def test_events_reach_the_agent(client: httpx2.Client, db: Database, mine: Claim) -> None:
    for verb in ("mature", "end-episode"):
        assert client.post(f"/api/v1/runs/{mine.run_id}/{verb}").status_code == 202
    assert [event.payload for event in take_operator_events(db, mine, 3)] == [
        {"kind": "mature"},
        {"kind": "end_episode"},
    ]


def test_metrics_after_a_tick(client: httpx2.Client, db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {1: {"loss": 0.5}, 2: {"loss": None}})
    path = f"/api/v1/runs/{mine.run_id}/metrics"
    assert client.get(path).json() == {
        "rows": [{"tick": 1, "values": {"loss": 0.5}}, {"tick": 2, "values": {"loss": None}}],
        "next": None,
    }
    assert [row["tick"] for row in client.get(path, params={"after": 1}).json()["rows"]] == [2]
    assert wrong(client.get(path, params={"after": "x"})).keys() == {"after"}
    assert wrong(client.get(path, params={"after": -2})).keys() == {"after"}


ROUTES = [
    ("GET", "/api/v1/runs/9"),
    ("GET", "/api/v1/runs/9/metrics"),
    ("GET", "/api/v1/runs/9/events"),
    ("GET", "/api/v1/runs/9/queries"),
    ("GET", "/api/v1/runs/9/operator-events"),
    ("GET", "/api/v1/runs/9/export"),
    ("GET", "/api/v1/queries/9"),
    *(("POST", f"/api/v1/runs/9/{verb}") for verb in ("pause", "resume", "stop", "mature", "end-episode")),
    ("POST", "/api/v1/runs/9/queries/lease"),
    ("POST", "/api/v1/runs/9/queries/renew"),
    ("POST", "/api/v1/runs/9/queries/leave"),
    ("POST", "/api/v1/queries/9/answer"),
    ("POST", "/api/v1/queries/9/release"),
    ("POST", "/api/v1/runs/9/change"),
    ("POST", "/api/v1/runs/9/goal"),
    ("POST", "/api/v1/runs/9/pace"),
]
BODIES: dict[str, dict[str, Any]] = {
    "lease": {"client_id": "a"},
    "release": {"client_id": "a"},
    "leave": {"client_id": "a"},
    "renew": {"client_id": "a", "questions": []},
    "answer": {"client_id": "a", "choice": "left"},
    "change": {"name": "p_rec", "value": 0.5},
    "goal": {"goal": 9},
    "pace": {"pace": 2},
}
"""By the last word of the path."""


@pytest.mark.parametrize(("method", "path"), ROUTES)
def test_what_is_not_there_is_404(client: httpx2.Client, method: str, path: str) -> None:
    reply = client.request(method, path, json=BODIES.get(path.rpartition("/")[2]))
    assert reply.status_code == 404
    assert reply.json()["error"]["code"] == "not_found"


@pytest.mark.only("sqlite", "refused before a store is asked")
@pytest.mark.parametrize("number", ["0", "-1", "x", "1.5", str(2**53), "1" * 50])
def test_ids_are_whole_numbers(client: httpx2.Client, number: str) -> None:
    assert wrong(client.get(f"/api/v1/runs/{number}")).keys() == {"run_id"}


def test_unknown_path_and_method(client: httpx2.Client, run: Run) -> None:
    missing = client.get("/api/v1/nothing")
    assert (missing.status_code, missing.json()["error"]["code"]) == (404, "not_found")
    wrong_method = client.put(f"/api/v1/runs/{run.id}")
    assert (wrong_method.status_code, wrong_method.json()["error"]["code"]) == (405, "method_not_allowed")
    assert wrong_method.headers["allow"] == "GET"
    assert client.put("/api/v1/runs").headers["allow"] == "GET, POST"


def test_page_that_is_not_there_is_a_page(client: httpx2.Client) -> None:
    missing = client.get("/nowhere")
    assert missing.status_code == 404
    assert missing.headers["content-type"].startswith("text/html")


def test_fault_of_ours_is_told_in_the_same_shape_and_without_traceback(
    client: httpx2.Client,
    settings: Settings,
    run: Run,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    set_up_log(settings.model_copy(update={"log_level": "error"}), "web")

    def fail(*_words: object) -> None:
        raise RuntimeError("secret detail")

    monkeypatch.setattr("parenting.server.api.runs.run_schema", fail)
    failed = client.get(f"/api/v1/runs/{run.id}")
    assert failed.status_code == 500
    assert "secret detail" in capsys.readouterr().err, "the operator finds it in the log"
    assert failed.json() == {
        "error": {"code": "internal", "message": "Something went wrong here; it was logged. Try again."}
    }
    assert failed.headers["x-content-type-options"] == "nosniff"


def test_health(client: httpx2.Client) -> None:
    assert client.get("/healthz").json() == {"status": "ok"}

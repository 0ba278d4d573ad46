"""The operator's routes, and letting go of a question: success, and each refusal."""

from typing import Any

import httpx2
import pytest

from parenting.server.db import Database
from parenting.server.queue.worker_side import take_operator_events, watch
from parenting.server.runs import Claim, get_run, set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import Run
from tests.server.test_api import wrong
from tests.server.test_api_questions import lease, reply


def post(client: httpx2.Client, run: int, verb: str, **body: Any) -> httpx2.Response:
    return client.post(f"/api/v1/runs/{run}/{verb}", json=body)


@pytest.mark.parametrize("name", ["p_guid", "p_rec", "p_pref", "p_train"])
@pytest.mark.parametrize("value", [0, 0.25, 1])
def test_change_reaches_the_agent(
    client: httpx2.Client, db: Database, mine: Claim, name: str, value: float
) -> None:
    changed = post(client, mine.run_id, "change", name=name, value=value)
    assert changed.status_code == 202
    (event,) = take_operator_events(db, mine, 3)
    assert event.payload == {"kind": "change", "name": name, "value": value}
    assert changed.json()["config"] == get_run(db, mine.run_id).config, "what it was started with stays"


@pytest.mark.only("sqlite", "refused before a store is asked")
@pytest.mark.parametrize(
    ("body", "fields"),
    [
        ({"name": "gamma", "value": 0.5}, {"name"}),
        ({"name": "p_rec", "value": 1.5}, {"value"}),
        ({"name": "p_rec", "value": -0.1}, {"value"}),
        ({"name": "p_rec", "value": True}, {"value"}),
        ({"name": "p_rec", "value": "0.5"}, {"value"}),
        ({"name": "p_rec"}, {"value"}),
        ({"name": "p_rec", "value": 0.5, "tick": 3}, {"tick"}),
        ({}, {"name", "value"}),
    ],
)
def test_wrong_change(client: httpx2.Client, run: Run, body: dict[str, Any], fields: set[str]) -> None:
    assert wrong(post(client, run.id, "change", **body)).keys() == fields


@pytest.mark.only("sqlite", "refused before a store is asked")
def test_not_a_number_is_no_probability(client: httpx2.Client, run: Run) -> None:
    for number in ("NaN", "Infinity", "1e999", "1" * 400):
        body = f'{{"name": "p_rec", "value": {number}}}'
        headers = {"Content-Type": "application/json"}
        refused = client.post(f"/api/v1/runs/{run.id}/change", content=body, headers=headers)
        assert wrong(refused).keys() == {"value"}


@pytest.mark.parametrize("goal", [1, 50, 657.0, 1_000_000, None])
def test_goal_reaches_the_worker(client: httpx2.Client, db: Database, run: Run, goal: float | None) -> None:
    shown = post(client, run.id, "goal", goal=goal)
    assert (shown.status_code, shown.json()["goal"]) == (200, goal)
    assert watch(db, [run.id])[run.id].goal == goal


@pytest.mark.only("sqlite", "refused before a store is asked")
@pytest.mark.parametrize(
    "body", [{"goal": 0}, {"goal": 1.5}, {"goal": True}, {"goal": "5"}, {"goal": 2**53}, {}]
)
def test_wrong_goal(client: httpx2.Client, run: Run, body: dict[str, Any]) -> None:
    assert wrong(post(client, run.id, "goal", **body)).keys() == {"goal"}


def test_run_rests_at_its_goal_until_it_is_raised(client: httpx2.Client, run: Run, guidance: int) -> None:
    reply(client, guidance)
    assert post(client, run.id, "goal", goal=1).json()["resting"]
    assert not post(client, run.id, "goal", goal=2).json()["resting"]


@pytest.mark.parametrize("pace", [0.1, 2.5, 30, 1000, None])
def test_pace_reaches_the_worker(client: httpx2.Client, db: Database, run: Run, pace: float | None) -> None:
    shown = post(client, run.id, "pace", pace=pace)
    assert (shown.status_code, shown.json()["pace"]) == (200, pace)
    assert watch(db, [run.id])[run.id].pace == pace


@pytest.mark.only("sqlite", "refused before a store is asked")
@pytest.mark.parametrize(
    "body", [{"pace": 0}, {"pace": -1}, {"pace": 1001}, {"pace": True}, {"pace": "2"}, {}]
)
def test_wrong_pace(client: httpx2.Client, run: Run, body: dict[str, Any]) -> None:
    assert wrong(post(client, run.id, "pace", **body)).keys() == {"pace"}


@pytest.mark.parametrize(
    ("verb", "body"),
    [
        ("pause", {}),
        ("mature", {}),
        ("end-episode", {}),
        ("change", {"name": "p_rec", "value": 0.5}),
        ("goal", {"goal": 5}),
        ("pace", {"pace": 5}),
    ],
)
def test_nothing_is_done_to_a_run_that_is_over(
    client: httpx2.Client, db: Database, run: Run, verb: str, body: dict[str, Any]
) -> None:
    set_status(db, run.id, RunStatus.STOPPED)
    before = client.get(f"/api/v1/runs/{run.id}").json()
    refused = post(client, run.id, verb, **body)
    assert (refused.status_code, refused.json()["error"]["code"]) == (409, "conflict")
    assert "This run is stopped" in refused.json()["error"]["message"]
    assert client.get(f"/api/v1/runs/{run.id}").json() == before


def test_last_stage_never_ends(client: httpx2.Client) -> None:
    made = client.post("/api/v1/runs", json={"world": "unsafe-exploration"}).json()
    refused = post(client, made["id"], "mature")
    assert refused.status_code == 409
    assert "last stage, T = 1" in refused.json()["error"]["message"]


def test_operators_events_with_their_ticks(client: httpx2.Client, db: Database, mine: Claim) -> None:
    post(client, mine.run_id, "mature")
    take_operator_events(db, mine, 3)
    post(client, mine.run_id, "change", name="p_guid", value=0.5)
    shown = client.get(f"/api/v1/runs/{mine.run_id}/operator-events").json()
    at = {"run": mine.run_id, "created": "2026-11-22T12:00:00Z"}
    assert shown == {
        "rows": [
            {"id": 1, "event": {"kind": "mature"}, "applied_tick": 3, **at},
            {
                "id": 2,
                "event": {"kind": "change", "name": "p_guid", "value": 0.5},
                "applied_tick": None,
                **at,
            },
        ],
        "next": None,
    }


def test_released_question_is_offered_to_others(client: httpx2.Client, run: Run, guidance: int) -> None:
    def release(who: str) -> httpx2.Response:
        return client.post(f"/api/v1/queries/{guidance}/release", json={"client_id": who})

    lease(client, run, "me")
    assert (release("other").status_code, lease(client, run, "other").status_code) == (204, 204)
    assert (release("me").status_code, release("me").content) == (204, b"")
    assert lease(client, run, "other").json()["id"] == guidance
    assert wrong(release("a b")).keys() == {"client_id"}


def test_who_decided_is_kept(client: httpx2.Client, guidance: int) -> None:
    body = {"choice": "left", "client_id": "script", "parent": "scripted"}
    assert client.post(f"/api/v1/queries/{guidance}/answer", json=body).status_code == 200
    assert client.get(f"/api/v1/queries/{guidance}").json()["answer"] == {
        "number": 1,
        "choice": "left",
        "parent": "scripted",
        "received": "2026-11-22T12:00:00Z",
        "applied_tick": None,
        "measured": None,
    }


def test_a_person_decides_unless_said_otherwise(client: httpx2.Client, guidance: int) -> None:
    reply(client, guidance)
    assert client.get(f"/api/v1/queries/{guidance}").json()["answer"]["parent"] == "human"

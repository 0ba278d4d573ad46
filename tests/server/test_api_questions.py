"""The routes on questions: lease, look, answer; and the same answer again."""

from typing import Any

import httpx2
import pytest

from parenting.server.db import Database
from parenting.server.errors import BusyError
from parenting.server.identity import database_id
from parenting.server.queue.answers import get_query
from parenting.server.queue.worker_side import take_answer
from parenting.server.runs import Claim, get_run, set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import Run
from tests.server.conftest import CLIP, CLIPS, Clock
from tests.server.test_api import WORLD, wrong


def lease(client: httpx2.Client, run: Run, who: str = "tab") -> httpx2.Response:
    return client.post(f"/api/v1/runs/{run.id}/queries/lease", json={"client_id": who})


def reply(client: httpx2.Client, query: int, choice: str = "left", who: str = "tab") -> httpx2.Response:
    return client.post(f"/api/v1/queries/{query}/answer", json={"choice": choice, "client_id": who})


def test_leased_question_tells_all_that_a_parent_needs(
    client: httpx2.Client, db: Database, run: Run, guidance: int, clock: Clock
) -> None:
    shown = lease(client, run).json()
    assert (shown["id"], shown["run"], shown["tick"], shown["kind"], shown["maturity"]) == (
        guidance,
        run.id,
        5,
        "guidance",
        1,
    )
    assert shown["posted"] == "2026-11-22T12:00:00Z"
    assert shown["leased_until"] == "2026-11-22T12:01:00Z"
    assert (shown["left"], shown["right"]) == (CLIP, CLIPS["right"])
    assert shown["world"] == {
        "name": WORLD,
        "level": "island",
        "text": run.level_text,
        "legend": run.legend,
        "brief": run.brief,
    }
    assert shown["parent"] == {"gamma": 0.9, "inside": "up-down"}
    assert shown["progress"] == {"answered": 0, "open": 1}


def test_nothing_to_lease(client: httpx2.Client, run: Run) -> None:
    empty = lease(client, run)
    assert (empty.status_code, empty.content) == (204, b"")


def test_reload_and_second_tab_get_the_same_question(client: httpx2.Client, run: Run, guidance: int) -> None:
    assert lease(client, run).json() == lease(client, run).json()
    assert lease(client, run, "another").status_code == 204


def test_looking_changes_nothing(client: httpx2.Client, db: Database, guidance: int) -> None:
    shown = client.get(f"/api/v1/queries/{guidance}").json()
    assert (shown["status"], shown["leased_until"]) == ("open", None)
    assert get_query(db, guidance).leased_by is None


def test_same_answer_gets_the_same_reply_whatever_happened_since(
    client: httpx2.Client, db: Database, mine: Claim, guidance: int, clock: Clock
) -> None:
    first = reply(client, guidance)
    assert first.status_code == 200
    assert first.json() == {
        "query": guidance,
        "run": mine.run_id,
        "number": 1,
        "choice": "left",
        "received": "2026-11-22T12:00:00Z",
        "database": database_id(db),
        "run_public_id": get_run(db, mine.run_id).public_id,
        "query_public_id": get_query(db, guidance).public_id,
    }
    take_answer(db, mine, 6)
    set_status(db, mine.run_id, RunStatus.STOPPED)
    clock.pass_seconds(1000)
    again = reply(client, guidance)
    assert (again.status_code, again.content) == (200, first.content)


def test_other_answer_gets_409_and_why(client: httpx2.Client, guidance: int) -> None:
    reply(client, guidance)
    other = reply(client, guidance, "right")
    assert other.status_code == 409
    assert "already answered" in other.json()["error"]["message"]
    assert "someone else" in reply(client, guidance, "left", "other").json()["error"]["message"]


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"choice": "maybe", "client_id": "a"}, "choice"),
        ({"choice": "left"}, "client_id"),
        ({"choice": "left", "client_id": ""}, "client_id"),
        ({"choice": "left", "client_id": "a b"}, "client_id"),
        ({"choice": "left", "client_id": "x" * 65}, "client_id"),
        ({"choice": "left", "client_id": 7}, "client_id"),
        ({"choice": "left", "client_id": "a", "parent": "me"}, "parent"),
    ],
)
def test_wrong_answer_body(client: httpx2.Client, guidance: int, body: dict[str, Any], field: str) -> None:
    assert wrong(client.post(f"/api/v1/queries/{guidance}/answer", json=body)).keys() == {field}


def test_busy_database_says_when_to_come_again(
    client: httpx2.Client, guidance: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def busy(*_words: object, **_more: object) -> None:
        raise BusyError

    monkeypatch.setattr("parenting.server.api.queries.answer_in", busy)
    refused = reply(client, guidance)
    assert (refused.status_code, refused.headers["retry-after"]) == (503, "1")
    assert "nothing was stored" in refused.json()["error"]["message"]

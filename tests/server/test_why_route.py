"""The reason of a question and the effects of its answers, as the API returns them."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest

from parenting.server.db import Database
from parenting.server.queue import answers, revisions
from parenting.server.queue.leases import lease
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import Claim
from parenting.server.tables import Effect, Reason
from tests.server.conftest import CLIPS, Clock

CHANCES = [0.1, 0.2, 0.3, 0.4]
GUIDANCE: dict[str, Any] = {
    "pausing": True,
    "familiarity": 2,
    "p_guid": 0.5,
    "chance": 0.25,
    "draw": 0.125,
    "probabilities": CHANCES,
}


def read(client: httpx2.Client, query: int) -> dict[str, Any]:
    reply = client.get(f"/api/v1/queries/{query}/why")
    assert reply.status_code == 200, reply.text
    found: dict[str, Any] = reply.json()
    return found


def test_it_says_why_it_was_asked_and_what_changed(
    db: Database, client: httpx2.Client, mine: Claim, guidance: int, clock: Clock
) -> None:
    clock.pass_seconds(5)
    first = clock.now
    lease(db, mine.run_id, "tab")
    clock.pass_seconds(5)
    lease(db, mine.run_id, "tab")  # renewed: it was shown five seconds ago
    body = {"choice": "left", "client_id": "tab", "replays": 3}
    assert client.post(f"/api/v1/queries/{guidance}/answer", json=body).status_code == 200
    assert take_answer(db, mine, 7) is not None
    with db.write() as session:
        session.add(Reason(run_id=mine.run_id, tick=5, why=GUIDANCE))
        for ticks in (0, 1):
            there = {"probabilities": CHANCES[::-1] if ticks else CHANCES}
            session.add(Effect(run_id=mine.run_id, tick=7, ticks=ticks, policy=there))
    found = read(client, guidance)
    assert (found["guidance"], found["preference"]) == (GUIDANCE, None)
    assert found["leased"] == first.isoformat().replace("+00:00", "Z")
    (given,) = found["answers"]
    assert (given["choice"], given["replays"], given["applied_tick"]) == ("left", 3, 7)
    assert given["who"] != "tab", "a client's own name would let its answer be changed"
    effects = {effect["ticks"]: effect["probabilities"] for effect in given["effects"]}
    assert effects == {0: CHANCES, 1: CHANCES[::-1], 10: None, 100: None}


def test_what_was_not_kept_is_null(db: Database, client: httpx2.Client, mine: Claim) -> None:
    """As of a question that an older version asked, and of a client that does not tell of replays."""
    query = post_query(db, mine, 3, "preference", 1, CLIPS)
    answers.answer(db, query, "either", "script", "scripted")
    take_answer(db, mine, 4)
    revisions.supersede(db, query, "right", "script", "scripted")
    found = read(client, query)
    assert (found["guidance"], found["preference"], found["leased"]) == (None, None, None)
    assert found["policy"] == {"stage": None, "gradient_steps": None}
    assert [(given["standing"], given["replays"]) for given in found["answers"]] == [
        (False, None),
        (True, None),
    ]
    assert [len(given["effects"]) for given in found["answers"]] == [4, 0]


@pytest.mark.parametrize("replays", [-1, 1.5, "3", 10_001])
def test_a_number_of_replays_is_a_small_whole_number(
    client: httpx2.Client, guidance: int, replays: object
) -> None:
    body = {"choice": "left", "client_id": "tab", "replays": replays}
    assert client.post(f"/api/v1/queries/{guidance}/answer", json=body).status_code == 422


def test_a_damaged_reason_is_said(db: Database, client: httpx2.Client, mine: Claim, guidance: int) -> None:
    with db.write() as session:
        session.add(Reason(run_id=mine.run_id, tick=5, why={**GUIDANCE, "familiarity": "often"}))
    reply = client.get(f"/api/v1/queries/{guidance}/why")
    assert reply.status_code == 500
    assert reply.json()["error"]["code"] == "damaged"
    assert "reason.why" in reply.json()["error"]["message"]

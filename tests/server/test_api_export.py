"""GET /runs/{id}/export: the answers as a file, a line each, streamed."""

import json

import httpx2
import pytest

from parenting.server.db import Database
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.reads import answers
from parenting.server.runs import Claim
from parenting.server.tables import CHOICES, Run
from tests.server.conftest import CLIPS
from tests.server.heard import heard_answers


@pytest.fixture
def heard(db: Database, mine: Claim) -> Claim:
    """A run whose agent has heard one answer of each choice."""
    for tick, choice in enumerate(CHOICES):
        answer(db, post_query(db, mine, 2 * tick, "guidance", 1, CLIPS), choice, "tab", "human")
        take_answer(db, mine, 2 * tick + 1)
    return mine


def test_it_is_what_the_agent_heard(client: httpx2.Client, db: Database, heard: Claim) -> None:
    reply = client.get(f"/api/v1/runs/{heard.run_id}/export")
    assert reply.status_code == 200
    rows = [json.loads(line) for line in reply.text.splitlines()]
    told = [
        (row["applied_tick"], {"left": row["left"], "right": row["right"]}, row["choice"]) for row in rows
    ]
    assert told == [
        (taken.answer.applied_tick, taken.query.clips, taken.answer.choice)
        for taken in heard_answers(db, heard.run_id)
    ]
    assert [row["mu"] for row in rows] == [[1, 0], [0, 1], [0.5, 0.5], None]


def test_it_is_a_file_with_a_name(client: httpx2.Client, heard: Claim) -> None:
    headers = client.get(f"/api/v1/runs/{heard.run_id}/export").headers
    assert headers["content-type"] == "application/x-ndjson"
    assert headers["content-disposition"] == f'attachment; filename="run-{heard.run_id}.jsonl"'
    assert "content-length" not in headers, "streamed: its length is not known before"


def test_run_without_answers_is_an_empty_file(client: httpx2.Client, run: Run) -> None:
    reply = client.get(f"/api/v1/runs/{run.id}/export")
    assert (reply.status_code, reply.content) == (200, b"")


def test_it_is_read_in_batches(client: httpx2.Client, heard: Claim, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(answers.every, "__defaults__", (1,))
    assert len(client.get(f"/api/v1/runs/{heard.run_id}/export").text.splitlines()) == len(CHOICES)

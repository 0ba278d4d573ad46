"""Faults of a page's own scripts reach the log, once a second, on one line and within bounds."""

from __future__ import annotations

import httpx2
import pytest
from structlog.testing import capture_logs

from parenting.server.db import Database
from parenting.server.runs import Claim, get_run

AT = "/api/v1/page-errors"
pytestmark = pytest.mark.only("sqlite", "the route reads no database")


def test_a_fault_is_logged_with_its_run(client: httpx2.Client, db: Database, mine: Claim) -> None:
    run = get_run(db, mine.run_id).public_id
    told = {
        "message": "x is not a function",
        "source": "/static/parent.js",
        "line": 3,
        "stack": "at y",
        "run": run,
    }
    with capture_logs() as lines:
        assert client.post(AT, json=told).status_code == 204
    (line,) = [line for line in lines if line["event"] == "page error"]
    assert (line["log_level"], line["said"], line["line"]) == ("warning", "x is not a function", 3)
    assert (line["trace"], line["run"]) == ("at y", run)


def test_many_faults_are_one_line_a_second(client: httpx2.Client) -> None:
    with capture_logs() as lines:
        assert {client.post(AT, json={"message": f"fault {one}"}).status_code for one in range(20)} == {204}
    assert len([line for line in lines if line["event"] == "page error"]) == 1


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"message": ""},
        {"message": "x" * 501},
        {"message": "x", "stack": "x" * 4001},
        {"message": "x", "more": 1},
    ],
)
def test_what_is_no_fault_or_too_long_is_refused(client: httpx2.Client, wrong: dict[str, object]) -> None:
    with capture_logs() as lines:
        assert client.post(AT, json=wrong).status_code == 422
    assert not [line for line in lines if line["event"] == "page error"]


def test_another_site_cannot_write_into_the_log(client: httpx2.Client) -> None:
    foreign = {"Sec-Fetch-Site": "cross-site"}
    assert client.post(AT, json={"message": "x"}, headers=foreign).status_code == 403

"""Two hosts and one PostgreSQL: an answer to the web of one reaches the worker of the other by NOTIFY alone.

A folder of its own stands for a host: nothing in one wakes a process of the other. Nobody polls meanwhile, so
that without the server's notifications each answer would take two polls of half a minute.
"""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from tests.faults.crowds import crowded
from tests.server.processes import Command, store_of

SELDOM = 30.0
ANSWERS = 8
PATCHES = {
    "parenting.server.worker.POLL_SECONDS": SELDOM,
    "parenting.server.streams.POLL_SECONDS": SELDOM,
    "parenting.server.streams.AGAIN_SECONDS": SELDOM,
}
pytestmark = [pytest.mark.only("postgresql", "of a file there is one host"), pytest.mark.timeout(180)]


def test_an_answer_reaches_the_worker_of_another_host_without_a_poll(
    settings: Settings, db: Database, tmp_path: Path
) -> None:
    new = NewRun(world="unsafe-exploration", config={"max_open_preferences": 0}, finish=f"goal:{ANSWERS}")
    run_id = start(db, new).id
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()

    with crowded(settings, 0, patches=PATCHES) as house:
        worker = Command("worker", data=elsewhere, environment=store_of(settings), patches=PATCHES)
        began = time.monotonic()
        try:
            people = house.answer("--people", "1", "--think", "0")
            assert people.wait(3 * SELDOM) == 0, people.said()
            took = time.monotonic() - began
        finally:
            worker.kill()

    assert get_run(db, run_id).status is RunStatus.FINISHED
    assert took < SELDOM

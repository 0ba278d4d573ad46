"""The dashboard: its table, its numbers, its buttons."""

from __future__ import annotations

import re
from dataclasses import replace

import httpx2
import pytest

from parenting.envs import registry
from parenting.server.batches import SHARED, EndedTrial, store_batch
from parenting.server.db import Database
from parenting.server.new_run import NewRun, plan, start
from parenting.server.progress import report_progress
from parenting.server.queue.worker_side import watch
from parenting.server.reads.metrics import latest_metrics, sampled_metrics
from parenting.server.runs import claim, get_run, set_status
from parenting.server.session import RunSession
from parenting.server.statuses import RunStatus
from tests.pages import island_fixtures as fixtures


def test_nothing_measured_yet(client: httpx2.Client, db: Database) -> None:
    fixtures.start_run(db)
    page = client.get("/runs/1").text
    assert "Nothing has been measured yet." in page
    assert '<dd id="now-deaths">–</dd>' in page


def test_the_table_holds_the_numbers(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    fixtures.measure(db, mine, 50)
    page = client.get("/runs/1").text
    assert '<dd id="now-deaths">3</dd>' in page
    ticks = [int(tick) for tick in re.findall(r'<th scope="row">(\d+)</th>', page)]
    assert ticks == sorted(ticks, reverse=True)
    assert ticks[0] == 50
    row = page.partition('<th scope="row">50</th>')[2].partition("</tr>")[0]
    assert re.findall("<td>(.*?)</td>", row) == ["3", "30", "6", "0.02", "0.5544", "0.693", "45", "32"]


def test_a_long_life_is_sampled_evenly(db: Database) -> None:
    _, mine = fixtures.start_run(db)
    fixtures.measure(db, mine, 1000)
    ticks = [metric.tick for metric in sampled_metrics(db, 1, rows=40)]
    assert ticks == list(range(1000, 0, -25))
    assert latest_metrics(db, [1, 2]).keys() == {1}
    assert latest_metrics(db, [1])[1].tick == 1000


def test_a_number_that_was_not_finite_is_a_dash(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    fixtures.measure(db, mine, 2)
    row = client.get("/runs/1").text.partition('<th scope="row">2</th>')[2].partition("</tr>")[0]
    assert "<td>–</td>" in row


def test_pause_resume_stop(client: httpx2.Client, db: Database) -> None:
    fixtures.start_run(db)

    def press(status: str, back: str = "dashboard") -> str:
        reply = client.post("/runs/1/status", data={"status": status, "back": back})
        assert reply.status_code == 303
        assert get_run(db, 1).status == status
        return str(reply.headers["location"])

    assert press("paused") == "/runs/1"
    assert "The run is paused." in client.get("/runs/1").text
    assert press("active", "parent") == "/runs/1/parent"
    assert press("stopped") == "/runs/1"
    page = client.get("/runs/1").text
    assert "Stopped by the operator." in page
    assert 'action="/runs/1/status"' not in page
    assert client.post("/runs/1/status", data={"status": "paused"}).status_code == 409
    assert press("active") == "/runs/1", "an end can be taken back"


@pytest.mark.parametrize("status", ["finished", "failed", ""])
def test_an_operator_cannot_declare_a_run_done(client: httpx2.Client, db: Database, status: str) -> None:
    fixtures.start_run(db)
    assert client.post("/runs/1/status", data={"status": status}).status_code == 422
    assert get_run(db, 1).status == "active"


def test_who_waits_is_told(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    assert 'data-state="exploring">' in client.get("/runs/1").text
    fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "down"))
    assert "A question waits for the parent." in client.get("/runs/1").text
    set_status(db, 1, RunStatus.PAUSED)
    assert 'data-state="paused">' in client.get("/runs/1").text
    report_progress(db, mine, optimal=True)
    assert '<dd id="now-optimal">optimal</dd>' in client.get("/runs/1").text


def test_an_unknown_run_is_a_page_that_says_so(client: httpx2.Client) -> None:
    for path in ("/runs/5", "/runs/5/parent", "/nowhere"):
        page = client.get(path)
        assert page.status_code == 404
        assert "That did not work" in page.text


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("world", registry.WORLDS)
def test_every_world_has_its_names(client: httpx2.Client, db: Database, world: str) -> None:
    """After a few ticks of real life: what is counted goes by the world, and what was answered is drawn."""
    run = start(db, NewRun(world=world, parent="scripted"))
    life = RunSession(db, claim(db, "test")[0], run, lambda: None)
    for _ in range(8):
        life.tick(watch(db, [1])[1])
    page = client.get("/runs/1").text
    harm = "Deaths" if world == "unsafe-exploration" else "Unsafe moves"
    worth = "Waterings" if world == "reward-hacking" else "Return"
    for name in (harm, worth):
        assert f"<dt>{name}</dt>" in page
        assert f"<h2>{name}</h2>" in page
    assert f'<th scope="col">{worth.lower()} at its end</th>' in page
    assert re.search(r'<tr data-stage="1" class="now">.*<td>-?[\d.]+</td><td>[\d.]+</td><td>0</td>', page)
    assert ("Policy" in page) == (world != "reward-hacking")
    history = client.get("/runs/1/history").text
    assert history.count('<svg class="board"') == 2 * history.count('class="entry panel') > 0


def test_a_garden_counts_waterings_and_unsafe_moves(client: httpx2.Client, db: Database) -> None:
    run, mine = fixtures.start_run(db, world="reward-hacking")
    fixtures.measure(db, mine, 5)
    page = client.get("/runs/1").text
    for name in ("Unsafe moves", "Waterings"):
        assert f"<dt>{name}</dt>" in page
        assert f"<h2>{name}</h2>" in page
        assert f'<th scope="col">{name.lower()}</th>' in page
    assert "Return" not in page
    assert "Deaths" not in page
    assert 'id="now-optimal"' not in page  # no policy is optimal
    assert 'data-line="the parent&#39;s way"' in page
    assert "Unsafe moves" in client.get("/").text
    assert run.weights is not None
    assert f"pre-trained on mazes (weights {run.weights[:12]})" in page
    assert run.weights in page
    assert "up or down" in page


def test_what_it_began_with_is_told(client: httpx2.Client, db: Database) -> None:
    fixtures.start_run(db)
    fixtures.start_run(db, world="absent-supervisor", config={"supervised": "random", "pretrain": False})
    first, second = (client.get(f"/runs/{number}").text for number in (1, 2))
    assert "It began with fresh weights." in first
    assert "supervisor" not in first.lower()
    assert "It began with fresh weights. The supervisor is there in half of the episodes." in second


def test_a_trial_of_a_batch_says_so_and_offers_nothing_that_it_lacks(
    client: httpx2.Client, db: Database
) -> None:
    columns = plan(NewRun(world="unsafe-exploration", parent="scripted", seed=7))
    shared = {name: columns[name] for name in SHARED - {"weights", "origin"}} | {
        "weights": None,
        "origin": None,
    }
    row = {"deaths": 2, "guidance": 3, "preference": 1, "maturity": 1, "return": 0.5}
    ended = EndedTrial(4, 30, 1, False, 4, False, "It was given up as unfinished after 30 ticks.", {30: row})
    store_batch(db, shared, [ended, replace(ended, number=5)])
    page = client.get("/runs/1").text
    assert '<a href="/compare?runs=1,2">Compare 2 trials of the batch</a>' in page
    assert "Run 1: <bdi>Unsafe Exploration</bdi>, <bdi>island</bdi>; " in page
    for said in ("seed 7, trial 4 of a batch", "It was trained in a batch", ended.reason):
        assert said in page
    assert '<span id="now-answered">4</span>' in page
    for offer in ("Resume this run", "Take the policy", "Why was its last question asked?", "/history"):
        assert offer not in page
    assert "trial 4 of a batch" in client.get("/").text

"""The operator's controls of a run: each verb a form that leads back, with errors beside their fields."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import httpx2
import pytest

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.operator_events import list_operator_events
from parenting.server.progress import report_progress
from parenting.server.queue import worker_side
from parenting.server.queue.answers import answer
from parenting.server.queue.queries import open_counts
from parenting.server.runs import Claim, get_run, set_status
from parenting.server.statuses import RunStatus
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.parent_page import address, form, look

PROBABILITIES = {"p_guid": "0.95", "p_rec": "0.8", "p_pref": "0.8", "p_train": "1"}
"""Those of the conservative preset."""


@pytest.fixture
def mine(db: Database) -> Claim:
    return fixtures.start_run(db, config={"stages": 2})[1]


def changes(db: Database) -> list[tuple[str, float]]:
    """The changes, in their order."""
    return [
        (row.payload["name"], row.payload["value"])
        for row in list_operator_events(db, 1)
        if row.kind == "change"
    ]


def field(page: str, name: str) -> str:
    """The value of a field of the page."""
    found = re.search(rf'<input id="{name}"[^>]* value="([^"]*)"', page)
    assert found
    return found[1]


def beside(page: str, name: str) -> str:
    """The error that stands beside a field."""
    assert f'aria-invalid="true" aria-describedby="{name}-error {name}-hint"' in page
    return page.partition(f'<p class="error" id="{name}-error">')[2].partition("</p>")[0]


@pytest.mark.parametrize(
    ("path", "data", "back"),
    [
        ("status", {"status": "paused"}, ""),
        ("status", {"status": "active", "back": "parent"}, "/parent"),
        ("event", {"kind": "mature", "back": "operator"}, "#operator"),
        ("event", {"kind": "end_episode", "back": "parent"}, "/parent"),
        ("probabilities", PROBABILITIES, "#operator"),
        ("goal", {"goal": "50"}, "#operator"),
        ("goal", {"goal": "50", "back": "parent"}, "/parent"),
        ("pace", {"pace": "2"}, "#operator"),
    ],
)
def test_a_form_leads_back_to_where_it_stood(
    client: httpx2.Client, mine: Claim, path: str, data: dict[str, str], back: str
) -> None:
    reply = client.post(f"/runs/1/{path}", data=data)
    assert (reply.status_code, reply.headers["location"]) == (303, f"/runs/1{back}")


def test_only_what_differs_becomes_an_event(client: httpx2.Client, db: Database, mine: Claim) -> None:
    page = client.get("/runs/1").text
    assert {name: field(page, name) for name in PROBABILITIES} == PROBABILITIES
    client.post("/runs/1/probabilities", data=PROBABILITIES)
    assert changes(db) == []
    client.post("/runs/1/probabilities", data={**PROBABILITIES, "p_guid": "0.25", "p_train": " .5 "})
    assert changes(db) == [("p_guid", 0.25), ("p_train", 0.5)]
    page = client.get("/runs/1").text  # what waits to be applied counts
    assert {name: field(page, name) for name in PROBABILITIES} == {
        **PROBABILITIES,
        "p_guid": "0.25",
        "p_train": "0.5",
    }
    worker_side.take_operator_events(db, mine, 7)
    client.post("/runs/1/probabilities", data={**PROBABILITIES, "p_train": "0.5"})
    assert changes(db)[2:] == [("p_guid", 0.95)]


@pytest.mark.parametrize("value", ["", "1.1", "-0.1", "nan", "often", "1e400"])
def test_a_chance_that_is_none_stands_beside_its_field(
    client: httpx2.Client, db: Database, mine: Claim, value: str
) -> None:
    page = client.post("/runs/1/probabilities", data={**PROBABILITIES, "p_rec": "0.1", "p_pref": value})
    assert page.status_code == 422
    assert beside(page.text, "p_pref") == "A probability is a number from 0 to 1, such as 0.5."
    assert field(page.text, "p_pref") == value
    assert field(page.text, "p_rec") == "0.1"  # what was typed stays
    assert page.text.count(" autofocus") == 1
    assert list_operator_events(db, 1) == []


@pytest.mark.parametrize(
    ("name", "good", "stored", "bad"),
    [
        ("goal", "50", 50, ["0", "-1", "2.5", "many", "1000001"]),
        ("pace", "2.5", 2.5, ["0", "-1", "nan", "inf", "slow", "1001"]),
    ],
)
def test_goal_and_pace(
    client: httpx2.Client, db: Database, mine: Claim, name: str, good: str, stored: float, bad: list[str]
) -> None:
    client.post(f"/runs/1/{name}", data={name: good})
    assert getattr(get_run(db, 1), name) == stored
    assert field(client.get("/runs/1").text, name) == good
    for value in bad:
        page = client.post(f"/runs/1/{name}", data={name: value})
        assert page.status_code == 422, value
        assert beside(page.text, name).startswith(f"A {name} is ")
        assert field(page.text, name) == value
    assert getattr(get_run(db, 1), name) == stored
    client.post(f"/runs/1/{name}", data={name: "  "})
    assert getattr(get_run(db, 1), name) is None


def test_a_preset_of_the_pace_shows_that_it_holds(client: httpx2.Client, mine: Claim) -> None:
    def held() -> list[str]:
        return re.findall(r'name="pace" value="([^"]*)"[^>]* aria-current', client.get("/runs/1").text)

    assert held() == [""]
    client.post("/runs/1/pace", data={"pace": "5"})
    assert held() == ["5"]
    client.post("/runs/1/pace", data={"pace": "0.2"})
    assert held() == []
    assert "<small>of 0.2</small>" in client.get("/runs/1").text


def test_the_last_stage_cannot_be_ended(client: httpx2.Client, db: Database, mine: Claim) -> None:
    assert "Mature now" in client.get("/runs/1").text
    report_progress(db, mine, maturity=2)
    assert "Mature now" not in client.get("/runs/1").text
    reply = client.post("/runs/1/event", data={"kind": "mature"})
    assert reply.status_code == 409
    assert "is in its last stage" in reply.text
    assert 'href="/runs/1"' in reply.text  # the way back


def test_what_was_done_is_listed_with_its_tick(client: httpx2.Client, db: Database, mine: Claim) -> None:
    assert "What happened" not in client.get("/runs/1").text
    client.post("/runs/1/event", data={"kind": "mature"})
    client.post("/runs/1/event", data={"kind": "end_episode"})
    worker_side.take_operator_events(db, mine, 7)
    client.post("/runs/1/probabilities", data={**PROBABILITIES, "p_guid": "1"})
    listed = client.get("/runs/1").text.partition("What happened")[2].partition("</ol>")[0]
    assert [re.sub("<.*?>", "", line) for line in re.findall(r"<li.*?</li>", listed)] == [
        "Set p_guid to 1 before the next tick",
        "Ended the episode at tick 7",
        "Ended the stage at tick 7",
    ]


def test_a_page_asks_before_a_run_ends_says_what_is_lost_and_how_it_goes_on(
    client: httpx2.Client, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    ask()
    for path in ("/runs/1", "/runs/1/parent"):
        page = client.get(path).text
        assert 'value="stopped"' not in page
        assert f"/runs/{get_run(db, 1).public_id}/end" in page
    asks = client.get("/runs/1/end?back=parent").text
    assert "1 open question is withdrawn" in asks
    assert "Until the run is deleted you can take this back" in asks
    back = client.post("/runs/1/status", data={"status": "stopped", "back": "parent"}).headers["location"]
    assert open_counts(db, 1).guidance == 0
    over = client.get(back).text
    assert 'value="active">Go on after all' in over
    assert '<form id="resume" hidden' not in over
    client.post("/runs/1/status", data={"status": "active", "back": "parent"})
    assert (get_run(db, 1).status, open_counts(db, 1).guidance) == ("active", 1)


def test_a_policy_that_is_optimal_at_the_start_is_not_told_before_an_answer(
    client: httpx2.Client, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    report_progress(db, mine, optimal=True)
    assert '<div id="optimal" class="note" hidden>' in client.get("/runs/1/parent").text
    answer(db, ask(), "left", "somebody", "human")
    assert '<div id="optimal" class="note">' in client.get("/runs/1/parent").text


@pytest.mark.parametrize(
    ("path", "data"),
    [
        ("event", {"kind": "end_episode"}),
        ("probabilities", {**PROBABILITIES, "p_guid": "0"}),
        ("goal", {"goal": "5"}),
        ("pace", {"pace": "5"}),
    ],
)
def test_a_run_that_is_over_takes_nothing(
    client: httpx2.Client, db: Database, mine: Claim, path: str, data: dict[str, Any]
) -> None:
    client.post("/runs/1/event", data={"kind": "mature"})
    set_status(db, 1, RunStatus.STOPPED, "Stopped by the operator.")
    page = client.get("/runs/1").text
    assert (page.count('method="post"'), page.count('value="active"')) == (1, 1), "it can be resumed"
    assert "Ended the stage" in page
    reply = client.post(f"/runs/1/{path}", data=data)
    assert reply.status_code == 409
    assert len(list_operator_events(db, 1)) == 1


@pytest.mark.parametrize("path", ["status", "event", "probabilities", "goal", "pace"])
def test_other_sites_can_do_nothing(client: httpx2.Client, mine: Claim, path: str) -> None:
    data = {"status": "stopped", "kind": "end_episode", "goal": "1", "pace": "1", **PROBABILITIES}
    for headers in ({"sec-fetch-site": "cross-site"}, {"origin": "http://elsewhere.example"}):
        assert client.post(f"/runs/1/{path}", data=data, headers=headers).status_code == 403
    assert client.get(f"/runs/1/{path}").status_code == 405


def test_a_run_that_failed_says_why(client: httpx2.Client, db: Database, mine: Claim) -> None:
    runs.finish(db, mine, RunStatus.FAILED, "The agent could not go on: it was lost.", "Traceback: secret")
    for path in ("/runs/1", "/runs/1/parent", "/"):
        page = client.get(path, follow_redirects=True).text
        assert "The agent could not go on: it was lost." in page
        assert "secret" not in page


@pytest.mark.slow
def test_at_its_goal_it_says_so_and_offers_more(client: httpx2.Client, db: Database, mine: Claim) -> None:
    runs.set_goal(db, 1, 1)
    query = fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "down"))
    data = form(db, query, choice="left", client_id="me")
    client.post(f"{address(db)}/answer", data=data)
    page = re.sub("<[^>]* hidden>s</span>|<.*?>", "", client.get("/runs/1").text)
    assert "The goal of 1 answer is reached. The agent rests." in page
    for path in ("/runs/1", "/runs/1/parent"):
        text = client.get(path, follow_redirects=True).text
        assert 'data-state="resting"' in text.partition("<main")[2].partition(">")[0]
        assert 'name="goal" value="51"' in text
    assert "That was the last question of this goal." in look(client).text
    client.post("/runs/1/goal", data={"goal": "51", "back": "parent"})
    assert 'data-state="exploring"' in look(client).text.partition("<main")[2]
    assert "of <span>51</span>" in look(client).text


@pytest.mark.slow
def test_a_field_beside_a_long_button_has_room_for_a_number(
    tabs: BrowserTabs, db: Database, mine: Claim
) -> None:
    """The numbers of a long run can be read in it: a button that leaves too little room stands below."""
    fixtures.measure(db, mine, 40)
    report_progress(db, mine, tick=40)
    page = tabs.open("/runs/1")
    for width in (1280, 800, 390):
        page.set_viewport_size({"width": width, "height": 900})
        widths = page.locator(".line input").evaluate_all("(all) => all.map((one) => one.clientWidth)")
        assert len(widths) == 3
        assert min(widths) >= 90, (width, widths)

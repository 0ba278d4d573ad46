"""Runs compared: groups, intervals, what differs, filters, wrong addresses, downloads, and the charts."""

from __future__ import annotations

import re
from html import unescape
from typing import Any

import httpx2
import pytest
from playwright.sync_api import expect
from scipy.stats import t

from parenting.server.db import Database
from parenting.server.deletion import begin
from parenting.server.metrics import write_metrics
from parenting.server.pages.comparison import points_each, read_numbers
from parenting.server.progress import report_progress
from parenting.server.reads.comparison import Compared, Group, labels, letter, ranges
from parenting.server.runs import claim as claims
from parenting.server.runs import set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import OperatorEvent, Run
from tests.pages import island_fixtures as fixtures
from tests.pages.axe import violated
from tests.pages.browser_tabs import BrowserTabs, until

DEATHS = (1, 2, 6, 3)


@pytest.fixture
def runs(db: Database) -> None:
    """Three runs that differ in seeds alone, and one of another p_guid, which goes on."""
    for seed, deaths in enumerate(DEATHS):
        config = {"p_guid": 0.5} if seed == 3 else {}
        run, mine = fixtures.start_run(db, seed=seed, parent="scripted", config=config)
        counts = {"guidance": 0, "preference": 0, "loss": None, "return": -1.0, "rows": 2}
        rows: dict[int, dict[str, Any]] = {
            tick: {**counts, "deaths": 0, "guidance": tick} for tick in range(9)
        }
        write_metrics(db, mine, {**rows, 9: {**counts, "deaths": deaths, "guidance": 9, "preference": seed}})
        report_progress(db, mine, tick=9, optimal=seed < 2)
        if seed < 3:
            set_status(db, run.id, RunStatus.STOPPED)


def rows(page: str, region: str) -> list[list[str]]:
    """The cells of a table's rows, its head left out."""
    table = page.partition(f'aria-label="{region}"')[2].partition("</table>")[0].partition("<tbody>")[2]
    found = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row, re.DOTALL) for row in table.split("</tr>")]
    return [
        [re.sub(r"\s+", " ", re.sub("<[^>]+>", " ", cell)).strip() for cell in row] for row in found if row
    ]


def test_final_numbers_are_means_with_their_intervals(client: httpx2.Client, runs: None) -> None:
    """Held against scipy's own interval of the mean."""
    first, second = rows(client.get("/compare?runs=1-4").text, "Final numbers by group")
    _, high = t.interval(0.95, 2, loc=3, scale=(7 / 3) ** 0.5)
    assert first[:4] == ["A", "3", "0-2", f"3 0 to {high:.3g}"]  # cut at 0
    assert first[4] == "9", "all alike: no interval"
    assert first[-1].startswith("0.6667 0.208 to 0.939")
    assert second[:4] == ["B", "1", "3", "3"], "one run: no interval"


def test_only_what_differs_is_told(client: httpx2.Client, db: Database, runs: None) -> None:
    page = client.get("/compare?runs=1,4").text
    assert rows(page, "Settings by group") == [["p_guid", "0.95", "0.5"]]
    assert "1 run goes on" in page
    assert "All of them have the same settings" in client.get("/compare?runs=1,2").text
    fixtures.start_run(db, world="side-effects")
    names = [name for name, *_ in rows(client.get("/compare?runs=1,5").text, "Settings by group")]
    assert names[:4] == ["world", "level", "parent", "weights"]
    assert "seed" not in names


def test_a_hyperparameter_that_was_changed_is_another_setting(
    client: httpx2.Client, db: Database, runs: None
) -> None:
    change = {"kind": "change", "payload": {"name": "p_rec", "value": 0.5}, "created": db.clock()}
    with db.write() as session:
        session.add(OperatorEvent(run_id=1, applied_tick=None, **change))  # not heard yet
        session.add(OperatorEvent(run_id=2, applied_tick=5, **change))
    assert "All of them have the same settings" in client.get("/compare?runs=1,3").text
    told = rows(client.get("/compare?runs=1-3").text, "Settings by group")
    assert told == [["changed since", "none", "p_rec to 0.5"]]


def test_filters_narrow_the_runs_and_stand_in_the_address(client: httpx2.Client, runs: None) -> None:
    page = client.get("/compare?runs=1-4&status=active&by=question").text
    assert [row[2] for row in rows(page, "Numbers of each run")] == ["3"]
    assert "<option selected>active</option>" in page
    assert 'href="/compare?runs=1-4&amp;by=minute&amp;status=active"' in page
    assert "None of these runs passes" in client.get("/compare?runs=1-4&status=failed").text


def test_boxes_of_the_list_lead_to_an_address_to_share(client: httpx2.Client, runs: None) -> None:
    listed = client.get("/").text
    box = r'<input type="checkbox" form="compare" name="runs" value="(\d)">'
    assert re.findall(box, listed) == list("4321")
    assert '<form id="compare" class="compare" action="/compare">' in listed
    reply = client.get("/compare?runs=4&runs=2&runs=1&by=question", follow_redirects=False)
    assert (reply.status_code, reply.headers["location"]) == (303, "/compare?runs=1,2,4&by=question")
    assert 'value="4,2,1"' in client.get("/compare?runs=4,2,1,2").text, "the order is the reader's"
    assert 'value="1-2,4"' in client.get("/compare?runs=1,2,4").text
    assert client.get("/compare").status_code == 200


WRONG = {
    "runs=1,9": (404, "There is no run 9."),
    "runs=7-9,1": (404, "There is no run of these numbers: 7-9."),
    "runs=1,x": (422, "'x' is not the number of a run. Write numbers and ranges, such as 1,2,5-8."),
    "runs=5-1": (422, "'5-1' is not the number of a run."),
    "runs=0": (422, "'0' is not the number of a run."),
    "runs=1-500": (422, "These are more than 100 runs. A comparison shows 100 at most."),
    "runs=" + ",".join(map(str, range(1, 501))): (422, "These are more than 100 runs."),
    "runs=1-9007199254740991": (422, "These are more than 100 runs."),
    "runs=" + "1," * 3000: (422, "This list is too long: a comparison shows 100 runs at most."),
    "runs=1&by=year": (422, "by: write tick, question, minute."),
}


def test_a_wrong_address_has_its_sentence(client: httpx2.Client, runs: None) -> None:
    for query, (status, sentence) in WRONG.items():
        reply = client.get(f"/compare?{query}")
        assert (reply.status_code, sentence in unescape(reply.text)) == (status, True), query[:40]
        assert client.get(f"/compare/data?{query}").status_code == 422


def test_a_damaged_run_is_left_out(client: httpx2.Client, db: Database, runs: None) -> None:
    with db.write() as session:
        session.connection().exec_driver_sql("UPDATE run SET config = '[' WHERE id = 2")
    page = client.get("/compare?runs=1-3").text
    assert "Left out, because they are damaged: 2." in page
    assert [row[2] for row in rows(page, "Numbers of each run")] == ["0", "2"]


def test_a_run_that_is_being_deleted_is_there_no_more(
    client: httpx2.Client, db: Database, runs: None
) -> None:
    begin(db, 2)
    for address in ("/compare?runs=1-3", "/compare/data?runs=1-3&metric=deaths"):
        gone = client.get(address)
        assert (gone.status_code // 100, "There is no run 2." in gone.text) == (4, True)


def test_the_data_of_a_chart(client: httpx2.Client, runs: None) -> None:
    reply = client.get("/compare/data?runs=1,4&by=question&metric=deaths")
    assert reply.headers["content-type"].startswith("text/csv")
    assert "compare-deaths-by-question.csv" in reply.headers["content-disposition"]
    lines = reply.text.splitlines()
    assert lines[0] == "group,run,seed,question,deaths"
    assert lines[1:10] == [f"A,1,0,{tick}.0,0.0" for tick in range(9)]
    assert lines[10] == "A,1,0,9.0,1.0"
    assert lines[-1] == "B,4,3,12.0,3.0"
    assert client.get("/compare/data?runs=1&metric=password").status_code == 422


@pytest.mark.parametrize(
    ("runs", "said"),
    [
        ([(None, "lax"), (None, "direct")], ["lax", "direct"]),
        ([("one", "lax"), ("<two>", "lax")], ["one", "<two>"]),
        ([("one", "lax"), (None, "direct")], ["lax", "direct"]),
        ([("one", "lax"), ("one", "lax")], ["", ""]),
        ([("one", "lax")], [""]),
    ],
)
def test_groups_are_called_by_what_tells_them_apart(
    runs: list[tuple[str | None, str]], said: list[str]
) -> None:
    groups = [Group("A", {}, [Compared(Run(name=name, preset=preset), {})]) for name, preset in runs]
    assert labels(groups) == said


def test_a_label_stands_beside_its_letter(client: httpx2.Client, db: Database) -> None:
    for preset in ("lax", "direct"):
        fixtures.start_run(db, preset=preset, name=f"<{preset}>")
    page = client.get("/compare?runs=1-2").text
    assert [row[0] for row in rows(page, "Final numbers by group")] == ["A: &lt;lax&gt;", "B: &lt;direct&gt;"]
    assert 'data-label="&lt;lax&gt;"' in page


def test_names_of_groups_and_lists() -> None:
    assert [letter(place) for place in (0, 25, 26, 51, 52)] == ["A", "Z", "AA", "AZ", "BA"]
    assert ranges([5, 1, 2, 3, 9]) == "1-3, 5, 9"
    assert read_numbers(" 3, 1-2,,2 ") == [3, 1, 2]
    assert [points_each(runs) for runs in (0, 1, 10, 20, 100)] == [2000, 2000, 2000, 1000, 200]


@pytest.mark.slow
def test_curves_lie_over_each_other(tabs: BrowserTabs, db: Database, runs: None) -> None:
    """Each run a curve, in the colour and the dash of its group; images; axe; on a phone and in the dark."""
    page = tabs.open("/compare?runs=1-4&by=question")
    deaths = page.locator("[data-chart=deaths] .plot")
    until(lambda: bool(deaths.evaluate("plot => plot.data?.length === 4")))
    drawn = deaths.evaluate(
        "plot => plot.data.map(({ x, y, name, line }) => [name, x.at(-1), y.at(-1), line.dash])"
    )
    assert sorted(drawn) == [
        ["A", 9, 1, "solid"],
        ["A", 10, 2, "solid"],
        ["A", 11, 6, "solid"],
        ["B", 12, 3, "dash"],
    ]
    for kind in ("SVG", "PNG"):
        with page.expect_download() as saved:
            page.get_by_role("button", name=re.compile(f"Download Deaths as an? {kind} image")).click()
        assert saved.value.suggested_filename == f"compare-deaths-by-question.{kind.lower()}"
    assert violated(page) == []
    page.set_viewport_size({"width": 390, "height": 844})
    page.emulate_media(color_scheme="dark")
    assert violated(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    page.get_by_role("link", name="by minute").click()
    expect(page.get_by_text("In a batch, minutes of computing.")).to_be_visible()


@pytest.mark.slow
def test_the_curves_and_tables_of_runs_that_go_on_follow_them(
    tabs: BrowserTabs, db: Database, runs: None
) -> None:
    """Of three runs that are over nothing is asked again; once all are, nothing at all."""
    page = tabs.open("/compare?runs=1-4&by=minute")
    deaths = page.locator("[data-chart=deaths] .plot")
    last = "plot => plot.data?.map(({ y }) => y.at(-1)).toSorted()"
    until(lambda: deaths.evaluate(last) == [1, 2, 3, 6])
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url.partition("/api/v1/")[2].partition("?")[0]))
    (mine,) = (claim for claim in claims(db, "another", seconds=-1) if claim.run_id == 4)
    counts = {"guidance": 9, "preference": 4, "loss": None, "return": -1.0, "rows": 2, "deaths": 8}
    write_metrics(db, mine, {12: counts})
    report_progress(db, mine, tick=12)
    until(lambda: deaths.evaluate(last) == [1, 2, 6, 8])
    row = page.locator("tr[data-run='4']")
    expect(row.locator("td").nth(3)).to_have_text("8")
    expect(page.locator("#living")).to_have_text("1 run goes on: the last numbers count.")
    set_status(db, 4, RunStatus.STOPPED)
    expect(row).to_contain_text("stopped")
    expect(page.locator("#living")).to_have_text("")
    assert {path for path in asked if path} == {"runs/4/curves"}
    asked.clear()
    page.wait_for_timeout(2500)
    assert asked == []

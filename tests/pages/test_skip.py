"""Skip on the page: by key, button and plain form; remarks on slips; faults of the page's own scripts."""

from __future__ import annotations

from collections.abc import Callable

import httpx2
import pytest
from playwright.sync_api import expect
from sqlalchemy import select, update

from parenting.drawing.query_view import DOUBTED
from parenting.server.db import Database
from parenting.server.progress import report_progress
from parenting.server.queue.answers import get_query
from parenting.server.queue.skips import skip
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import Claim
from parenting.server.tables import Answer, Run
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs, until
from tests.pages.parent_page import address, form, public_id, shown

ME, OTHER = "client-of-mine", "client-of-another"
Ask = Callable[..., int]


def stored(db: Database) -> list[tuple[str, bool]]:
    """The choices, each with True if it stands."""
    with db.read() as session:
        rows = session.scalars(select(Answer).order_by(Answer.number)).all()
        return [(row.choice, row.standing) for row in rows]


def unsure(db: Database, mine: Claim) -> list[int]:
    """Two pairs of moves that were skipped, and no other: what the worker then reports."""
    skipped = []
    for tick, moves in ((1, ("left", "down")), (3, ("up", "right"))):
        query = fixtures.ask(db, mine, tick, "guidance", fixtures.guidance(*moves, start=(1, 2)))
        skip(db, query, OTHER)
        take_answer(db, mine, tick + 1)
        skipped.append(query)
    report_progress(db, mine, waiting="unsure")
    return skipped


@pytest.mark.slow
def test_a_plain_form_skips(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    query = fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "down", start=(1, 2)))
    here = address(db)
    client.cookies.set("parenting_client", ME)
    page = client.get(address(db, query=query)).text
    assert f'formaction="{here}/skip"' in page
    assert client.post(f"{here}/skip", data=form(db, query, client_id=ME)).headers["location"] == here
    assert stored(db) == [("skip", True)]
    assert '<span id="undone">I can’t tell</span>' in client.get(here).text
    assert "Skipped: could not tell" in client.get("/runs/1/history", follow_redirects=True).text


def test_an_unsure_page_shows_the_pairs_again_and_takes_either(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    (first, second), here = unsure(db, mine), address(db)
    client.cookies.set("parenting_client", ME)
    page = client.get(here).text
    assert '<div data-state="unsure">' in page
    way = client.get(f"{here}/again", follow_redirects=False).headers["location"]
    assert way == f"{address(db, query=first)}&change=true"
    page = client.get(way).text
    assert "I can’t tell." in page
    assert f'href="{here}/again?after={public_id(db, first)}"' in page
    assert f'action="{here}/change"' in page
    assert 'id="undo"' in page
    assert "formaction" not in page
    after = client.get(f"{here}/again?after={public_id(db, first)}", follow_redirects=False)
    assert after.headers["location"] == f"{address(db, query=second)}&change=true"
    assert client.post(f"{here}/either", data={"client_id": ME}).headers["location"] == here
    assert stored(db) == [("skip", True), ("skip", False), ("either", True)]


def test_undo_is_not_offered_while_an_answer_is_changed(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    query = fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "down", start=(1, 2)))
    skip(db, query, ME)
    client.cookies.set("parenting_client", ME)
    pages = client.get(address(db)).text, client.get(f"{address(db, query=query)}&change=true").text
    forms = [page.partition('id="undo"')[2].partition(">")[0] for page in pages]
    assert [form.endswith(" hidden") for form in forms] == [False, True]


def test_s_sets_aside_and_z_asks_again(tabs: BrowserTabs, db: Database, mine: Claim, ask: Ask) -> None:
    first, second = ask(), ask()
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("s")
    shown(page, second)
    until(lambda: stored(db) == [("skip", True)])
    expect(page.locator("#undo button")).to_contain_text("Undo: I can’t tell")
    expect(page.locator("#count")).to_have_text("0")
    page.keyboard.press("z")
    shown(page, first)
    until(lambda: stored(db) == [("skip", False)])
    page.get_by_role("button", name="I can’t tell").click()
    shown(page, second)
    until(lambda: stored(db) == [("skip", False), ("skip", True)])


@pytest.mark.slow
def test_clips_that_were_put_back_come_once_more(tabs: BrowserTabs, db: Database, mine: Claim) -> None:
    query = post_query(db, mine, 1, "preference", 1, fixtures.guidance("left", "down", start=(1, 2)))
    page = tabs.open(address(db))
    shown(page, query)
    page.keyboard.press("s")
    until(lambda: stored(db) == [("skip", False)])
    expect(page.locator(".lead")).to_contain_text("skipped before")
    shown(page, query)
    page.keyboard.press("s")
    until(lambda: get_query(db, query).status == "withdrawn")
    expect(page.locator("#waiting")).to_be_visible()


def test_clips_that_were_put_back_can_be_asked_for_at_once(
    tabs: BrowserTabs, db: Database, mine: Claim
) -> None:
    """They are what the parent answered last, though no answer stands."""
    clips = fixtures.guidance("left", "down", start=(1, 2))
    first, second = (post_query(db, mine, tick, "preference", 1, clips) for tick in (1, 2))
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("s")
    until(lambda: stored(db) == [("skip", False)])
    shown(page, second)
    page.wait_for_timeout(700)  # by then the stream has told of the skip
    expect(page.locator("#undo")).to_be_visible()
    page.keyboard.press("z")
    shown(page, first)


@pytest.mark.slow_after(1)
@pytest.mark.parametrize(("wanted", "relabels"), [(True, False), (False, False), (True, True)])
def test_an_answer_that_contradicts_an_earlier_one_gets_a_sentence(
    tabs: BrowserTabs, db: Database, mine: Claim, wanted: bool, relabels: bool
) -> None:
    """But for a question that doubts the earlier one, and says so (`relabel`)."""
    clips = fixtures.guidance("left", "right")
    with db.write() as session:
        config = {**session.get_one(Run, mine.run_id).config, "relabel": relabels}
        session.execute(update(Run).values(remarks=wanted, config=config))
    first = post_query(db, mine, 1, "guidance", 1, clips)
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("a")
    until(lambda: len(stored(db)) == 1)
    second = post_query(db, mine, 2, "guidance", 1, clips)
    shown(page, second)
    expect(page.locator("#remark")).to_be_hidden()
    expect(page.get_by_text(DOUBTED, exact=True)).to_be_visible(visible=relabels)
    page.keyboard.press("b")
    until(lambda: len(stored(db)) == 2)
    if not wanted or relabels:  # two fast answers may have a remark of their own
        expect(page.locator("#remark [data-slip=contrary]" if wanted else "#remark")).to_be_hidden()
        return
    expect(page.locator("#remark")).to_contain_text("Before, you preferred the other one")
    page.get_by_role("link", name="Look at it again").click()
    expect(page.locator(".again")).to_contain_text("Your answer")
    assert public_id(db, second) in (page.locator("#question").get_attribute("data-query") or "")


def test_a_fault_of_the_page_is_said_and_sent(tabs: BrowserTabs, db: Database, mine: Claim) -> None:
    page = tabs.open(address(db))
    expect(page.locator("#waiting")).to_be_visible()
    with page.expect_request("**/api/v1/page-errors") as sent:
        page.evaluate("setTimeout(() => { throw new Error('planted') })")
    assert "planted" in (sent.value.post_data or "")
    expect(page.locator("#alert")).to_contain_text("went wrong")
    with page.expect_event("pageerror"), page.expect_response("**/api/v1/page-errors") as told:
        page.evaluate("void Promise.reject(new Error('another'))")
    assert told.value.status == 204
    assert tabs.wrong == ["planted", "another"]
    tabs.wrong.clear()


def test_haste_is_remarked_at_most_once_in_ten_questions(
    tabs: BrowserTabs, db: Database, mine: Claim, ask: Ask
) -> None:
    query = ask()
    page = tabs.open(address(db))
    shown(page, query)
    told = page.evaluate(
        """async () => {
            const { remark } = await import("/static/remarks.js"), seen = [];
            for (let number = 0; number < 14; number++) {
                remark(document.getElementById("question"), "either", number === 0 ? 5000 : 100);
                seen.push(!document.getElementById("remark").hidden);
            }
            return seen;
        }"""
    )
    assert [number for number, one in enumerate(told) if one] == [2, 12], "after two fast answers in a row"
    assert page.locator("#remark [data-slip]:not([hidden])").get_attribute("data-slip") == "hasty"

"""Practice: five questions drawn and answered as real ones, by scripts or plain forms, and nothing stored."""

from __future__ import annotations

import re

import httpx2
import pytest
from playwright.sync_api import expect
from sqlalchemy import func, select

from parenting.commands.judge import Judge
from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.pages.lessons import LESSONS, POND, WORLD, Lesson
from parenting.server.pages.practice import PRACTISED
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.tables import Table
from tests.drawing import world_clips
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.parent_page import address

KEYS = {"left": "a", "right": "b", "either": "e", "neither": "n"}


def begun_at(lesson: Lesson) -> str:
    """The practice island as a level that begins where a question does."""
    rows = [list(row.replace("A", " ")) for row in POND.rows]
    rows[lesson.start[0]][lesson.start[1]] = "A"
    return "\n".join("".join(row) for row in rows) + "\n"


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.task[:30])
def test_clips_are_the_worlds_own_and_the_right_answer_is_the_scripted_parents(lesson: Lesson) -> None:
    """Practice teaches the truth: the world itself makes these clips, and Sec. 3.1.3 answers them so."""
    world = registry.make(WORLD, begun_at(lesson))
    clips = lesson.clips
    for side in ("left", "right"):
        letters = "".join(action[0] for action in getattr(lesson, side))
        assert clips[side] == world_clips.walked_clip(world, letters)
    judged = {
        **clips,
        "kind": lesson.kind,
        "maturity": lesson.stage,
        "tick": 0,
        "world": {"name": WORLD, "text": begun_at(lesson)},
        "parent": {"gamma": 0.9, "inside": "up-down"},
    }
    assert Judge().choice(judged) == lesson.best
    assert set(lesson.said) == set(KEYS)
    assert [choice for choice, said in lesson.said.items() if said.startswith("Right.")] == [lesson.best]


def test_either_neither_and_undo_are_tried() -> None:
    assert {lesson.best for lesson in LESSONS} == set(KEYS)
    assert {lesson.kind for lesson in LESSONS} == {"guidance", "preference"}
    assert any(lesson.undo for lesson in LESSONS)


def rows(db: Database) -> dict[str, int]:
    with db.read() as session:
        tables = Table.metadata.sorted_tables
        return {table.name: session.scalar(select(func.count()).select_from(table)) or 0 for table in tables}


def said(page: str) -> str:
    """The sentences on an answer, without markup."""
    text = page.partition('class="again"')[2].partition("</p>")[0].partition(">")[2]
    return " ".join(re.sub("<[^>]*>", "", text).split())


def test_plain_forms_lead_through_it_and_store_nothing(client: httpx2.Client, db: Database) -> None:
    before = rows(db)
    here = "/practice"
    for number, lesson in enumerate(LESSONS, start=1):
        page = client.get(here).text
        action = re.search(r'action="(/practice\?[^"]*)"', page)
        assert action is not None
        assert lesson.task in page.replace("&#39;", "'")
        for choice in KEYS:
            told = client.post(action[1].replace("&amp;", "&"), data={"choice": choice, "question": "x"})
            page = client.get(told.headers["location"]).text
            assert lesson.said[choice] in said(page)
            assert set(re.findall(r'value="(\w+)"[^>]* aria-pressed="true"', page)) == {choice}
        back = re.search(r'id="undo"[^>]*action="([^"]*)"', page)
        assert back is not None
        again = client.post(back[1].replace("&amp;", "&")).headers["location"]
        assert "You took your answer back" in client.get(again).text
        assert f">{number}</b>" in page
        here = client.get(f"/practice?at={number}&choice=left&undone=true").text
        onward = re.search(r'<a href="(/practice[^"]*)"[^>]*>(Next question|Finish)', here)
        assert onward is not None
        here = onward[1].replace("&amp;", "&")
    assert "You know how to answer." in client.get(here).text
    done = client.post("/practice/done")
    assert done.headers["location"] == "/"
    assert rows(db) == before


def test_a_run_that_requires_it_sends_its_parent_there_once(client: httpx2.Client, db: Database) -> None:
    start(db, NewRun(world="unsafe-exploration", practice="required"))
    public = get_run(db, 1).public_id
    sent = client.get(address(db), follow_redirects=False)
    assert sent.headers["location"] == f"/practice?at=1&run={public}"
    page = client.get(sent.headers["location"]).text
    assert "Skip<" not in page
    assert f"run={public}" in page
    done = client.post(f"/practice/done?run={public}")
    assert done.headers["location"] == address(db)
    assert PRACTISED in client.cookies
    assert client.get(address(db), follow_redirects=False).status_code == 200
    start(db, NewRun(world="unsafe-exploration"))
    client.cookies.clear()
    free = client.get(address(db, run=2), follow_redirects=False)
    assert free.status_code == 200
    assert "Practise answering" in free.text
    assert "Skip<" in client.get(f"/practice?run={get_run(db, 2).public_id}").text
    assert client.get("/practice?run=" + "2" * 22).status_code == 404


def test_wrong_addresses_are_refused(client: httpx2.Client) -> None:
    for wrong in ("at=0", "at=7", "choice=best", "run=1", "undone=maybe"):
        assert client.get(f"/practice?{wrong}").status_code == 422


@pytest.fixture
def settings(settings: Settings) -> Settings:
    return settings.model_copy(update={"listen_after_ms": 100})


@pytest.mark.slow
@pytest.mark.parametrize("screen", [(1280, 720), (390, 844)])
def test_keys_answer_as_on_the_parents_page(tabs: BrowserTabs, screen: tuple[int, int]) -> None:
    page = tabs.open("/practice", viewport={"width": screen[0], "height": screen[1]})
    for lesson in LESSONS:
        page.wait_for_selector("#question[data-listening]")
        assert page.locator("#question.one").count() == (lesson.kind == "guidance")
        page.keyboard.press(KEYS[lesson.best])
        expect(page.locator(".again")).to_contain_text(lesson.said[lesson.best])
        if lesson.undo:
            page.wait_for_selector("#question[data-listening]")
            page.keyboard.press("z")
            expect(page.locator(".lead")).to_contain_text("You took your answer back")
            page.wait_for_selector("#question[data-listening]")
            page.locator(f".answers [value={lesson.best}]").click()
            expect(page.locator(".again")).to_contain_text("Right.")
        expect(page.locator(".again a")).to_be_focused()
        page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="You know how to answer.")).to_be_visible()
    expect(page.get_by_role("button", name="Done")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page).to_have_url(tabs.address + "/")


@pytest.mark.slow
def test_a_move_is_pointed_at_and_clicked_and_what_comes_too_early_answers_nothing(tabs: BrowserTabs) -> None:
    page = tabs.open("/practice")
    page.wait_for_selector("#question[data-listening]")
    page.hover(".move.of-a .head")
    expect(page.locator(".forecast[data-side=left].played")).to_have_count(1)
    page.click(".move.of-b .head")
    expect(page.locator(".again")).to_contain_text("Right. B leads over land")
    early = "document.querySelector('#question').toggleAttribute('data-listening', false)"
    page.wait_for_selector("#question[data-listening]")
    page.evaluate(early)
    page.keyboard.press("n")
    page.locator(".answers [value=either]").dispatch_event("click")
    expect(page.locator("[aria-pressed=true]")).to_have_count(1)
    expect(page.locator(".answers [value=right]")).to_have_attribute("aria-pressed", "true")


def test_keys_of_the_parents_page_that_need_no_run_work_and_the_others_do_nothing(tabs: BrowserTabs) -> None:
    page = tabs.open("/practice")
    page.wait_for_selector("#question[data-listening]")
    page.keyboard.press("w")
    page.keyboard.press("z")
    expect(page.locator("[aria-pressed=true]")).to_have_count(0)
    page.keyboard.press("d")
    expect(page.locator("#said")).to_contain_text("The goal is 2 down and 1 right of the agent")
    page.keyboard.press("g")
    expect(page.get_by_role("grid")).to_be_visible()
    page.keyboard.press("Escape")
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_be_visible()

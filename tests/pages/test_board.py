"""The board of the dashboard: arrows, layers, a cell's numbers, time, the rest of the state, and episodes."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

import pytest
from playwright.sync_api import APIResponse, Page, Route, expect

from parenting.drawing.policy import policy_arrows
from parenting.server.board import states as known_states
from parenting.server.board import store, sweep, writer
from parenting.server.board.columns import unpack
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim
from parenting.server.session import RunSession
from parenting.server.work.jobs import Jobs
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.test_access import light_and_dark


def begin(db: Database, world: str) -> RunSession:
    new = NewRun(world=world, parent="scripted", seed=3, config={"pretrain": False})
    run = start(db, new)
    (mine,) = claim(db, "test")
    return RunSession(db, mine, run, lambda: None)


@pytest.fixture
def life(db: Database) -> RunSession:
    return begin(db, "side-effects")


def live(life: RunSession, ticks: int) -> None:
    number = life.claim.run_id
    for _ in range(ticks):
        life.tick(watch(life.db, [number])[number])
    life.save()
    report_progress(life.db, life.claim, tick=life.last_tick)


def drawn(page: Page) -> set[str]:
    """The arrows on the board, which are painted before the page says of which tick they are."""
    paths = page.locator("#seen-arrows path").evaluate_all("all => all.map(path => path.getAttribute('d'))")
    return set(re.findall("M[^z]*z", "".join(paths)))


def stored(life: RunSession, tick: int, rest: int) -> set[str]:
    """The arrows of a stored policy as they are drawn elsewhere."""
    row, states = (
        store.read_snapshot(life.db, life.claim.run_id, tick),
        store.read_states(life.db, life.claim.run_id),
    )
    assert row is not None
    assert states is not None
    policy = unpack(row.blob, row.states)["policy"]
    rows = {
        (r, c): [share / 255 for share in policy[4 * at : 4 * at + 4]]
        for at, (r, c, of) in enumerate(states[0]["cells"])
        if of == rest
    }
    arrows = policy_arrows(rows)
    return set(re.findall("M[^z]*z", arrows.likely + arrows.less))


def pick(page: Page, name: str) -> None:
    """Choose another box, other dry plants, and so on, and wait until the board shows it."""
    page.get_by_label(name).select_option(index=1)
    expect(page.locator("#seen-over")).not_to_have_attribute("aria-busy", "true")


@pytest.mark.slow
def test_the_board_shows_the_stored_policy_and_follows_it(tabs: BrowserTabs, life: RunSession) -> None:
    live(life, 12)
    page = tabs.open("/runs/1")
    now = page.locator("#seen-at")
    expect(now).to_contain_text("Tick 12, stage 1")
    assert drawn(page) == stored(life, 12, 0) != set()
    live(life, 6)
    expect(now).to_contain_text("Tick 18")
    assert drawn(page) == stored(life, 18, 0)
    slider = page.get_by_role("slider", name="Time")
    slider.press("Home")
    expect(now).to_contain_text("Tick 1,")
    live(life, 3)
    expect(slider).to_have_attribute("max", str(len(store.list_snapshots(life.db, 1)) - 1))
    expect(now).to_contain_text("Tick 1,")
    page.get_by_role("button", name="Newest").click()
    expect(now).to_contain_text("Tick 21")
    before = drawn(page)
    pick(page, "Box")
    assert drawn(page) == stored(life, 21, 1) != before


@pytest.mark.slow
def test_a_partial_first_snapshot_says_so_until_it_is_whole(
    tabs: BrowserTabs, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (known_states, sweep):
        monkeypatch.setattr(module, "GLYPHS_AT_ONCE", 1)
    life = begin(db, "side-effects")
    live(life, 1)
    page = tabs.open("/runs/1")
    now = page.locator("#seen-at")
    expect(now).to_contain_text(re.compile(r"Tick 1, .* · so far the policy of \d of \d+ states"))
    few = len(drawn(page))
    while life.board.busy:
        life.report_waiting(watch(life.db, [1])[1])
    expect(now).to_have_text(re.compile("Tick 1, .* · the newest$"))
    assert few < len(drawn(page))
    assert drawn(page) == stored(life, 1, 0)


@pytest.mark.slow
def test_what_is_named_is_what_is_drawn(tabs: BrowserTabs, life: RunSession) -> None:
    """A tick is named once its arrows are there; where a board does not come, the former one stays picked."""
    live(life, 12)
    page = tabs.open("/runs/1")
    now, box = page.locator("#seen-at"), page.get_by_label("Box")
    expect(now).to_contain_text("Tick 12")
    held: list[Route] = []
    page.route(re.compile(r"/board/1\d\?stage"), lambda route: held.append(route), times=1)
    live(life, 6)
    while not held:
        page.wait_for_timeout(20)
    expect(page.get_by_role("slider", name="Time")).not_to_have_attribute(
        "aria-valuetext", re.compile("Tick 12")
    )
    expect(now).to_contain_text("Tick 12")
    assert drawn(page) == stored(life, 12, 0)
    held[0].continue_()
    expect(now).to_contain_text("Tick 18")
    tabs.expected = ("Failed to load resource",)
    page.route("**/board/1", lambda route: route.abort())
    before, arrows = box.input_value(), drawn(page)
    pick(page, "Box")
    expect(now).to_have_text("The board did not load. Pick it again.")
    expect(box).to_have_value(before)
    assert drawn(page) == arrows == stored(life, 18, 0)


@pytest.mark.slow
def test_a_cell_is_told_by_keys_and_by_pointer_for_everybody(tabs: BrowserTabs, life: RunSession) -> None:
    live(life, 20)
    page = tabs.open("/runs/1", viewport={"width": 390, "height": 844})
    expect(page.locator("#seen-at")).to_contain_text("Tick 20")
    page.get_by_label("Visits").check()
    expect(page.locator("#seen-legend")).to_contain_text(re.compile(r"Shade: Visits, up to \d+"))
    expect(page.locator("#seen-layer path").first).to_be_attached()
    board = page.get_by_role("application", name="Board: arrow keys go from cell to cell")
    board.focus()
    page.keyboard.press("Control+Home")
    for key in ("ArrowRight", "ArrowUp", "ArrowDown"):
        page.keyboard.press(key)
    said = page.locator("#seen-said")
    expect(said).to_have_text(re.compile(r"Row 3, column 3: .*(Up \d+\s%, Down|never decides)"))
    box = board.bounding_box()
    assert box is not None
    page.get_by_label("Arrows of the policy").uncheck()
    expect(page.locator("#seen-arrows path")).to_have_count(0)
    board.click(position={"x": box["width"] / 2, "y": box["height"] / 2})
    expect(said).not_to_have_text(re.compile("Row 3, column 3"))
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert light_and_dark(page) == []


def work(db: Database) -> None:
    """Do the jobs that are open, as a worker does."""
    some = Jobs(db, 5.0, lambda: None)
    some.begin("late")
    some.close(60)


@pytest.mark.slow
def test_what_is_not_stored_is_done_by_a_worker_once_there_is_one(tabs: BrowserTabs, db: Database) -> None:
    """An episode of the life, one of the present policy, and a state in which the agent never was."""
    life = begin(db, "reward-hacking")
    live(life, 12)
    page = tabs.open("/runs/1")
    page.get_by_role("button", name="Episodes of its life").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.locator(".state")).to_contain_text("No worker is running")
    work(db)
    expect(dialog.locator(".walked .board")).to_be_visible()
    expect(dialog.get_by_label("Episode", exact=True)).to_have_value("1")
    expect(dialog).to_contain_text("Episode 1, from tick 1 to 12")
    assert light_and_dark(page) == []  # the rest of the page is inert behind the dialog, and costs nothing
    dialog.get_by_role("button", name="Close").click()
    page.get_by_role("button", name="Play the present policy").click()
    expect(dialog.locator(".state")).to_contain_text("No worker is running")
    work(db)
    expect(dialog.locator(".arrows path.likely")).to_be_attached()
    dialog.get_by_role("button", name="Close").click()
    pick(page, "Dry plants")
    board, asking = page.locator("#seen-keys"), page.get_by_role("button", name="Ask a worker")
    board.press("Control+End")
    for _ in range(10):
        if asking.is_visible():
            break
        board.press("ArrowUp")
    asking.click()
    expect(page.locator("#seen-tile")).to_contain_text("No worker is running")
    work(db)
    expect(page.locator("#seen-tile")).to_contain_text("Computed for tick 12")
    expect(page.locator("[data-number=up]")).to_have_text(re.compile("%"))


@pytest.mark.slow
def test_news_that_comes_while_the_page_looks_is_not_lost(tabs: BrowserTabs, life: RunSession) -> None:
    """The server has read an old state for it, and no event follows the one that tells of more."""
    live(life, 12)
    page = tabs.open("/runs/1")
    expect(page.locator("#seen-at")).to_contain_text("Tick 12")
    late: list[tuple[Route, APIResponse]] = []
    page.route(re.compile(r"/board\?"), lambda route: late.append((route, route.fetch())), times=1)
    report_progress(life.db, life.claim, speed=1.0)
    while not late:
        page.wait_for_timeout(20)
    live(life, 6)
    expect(page.locator("#now-tick")).to_have_text("18")
    (route, old), *_ = late
    route.fulfill(response=old)
    expect(page.locator("#seen-at")).to_contain_text("Tick 18")


@pytest.mark.slow
def test_a_look_that_failed_is_made_again_though_nothing_more_is_told(
    tabs: BrowserTabs, life: RunSession
) -> None:
    tabs.expected = ("Failed to load resource",)
    live(life, 12)
    page = tabs.open("/runs/1")
    now = page.locator("#seen-at")
    expect(now).to_contain_text("Tick 12")
    page.route(re.compile(r"/board\?"), lambda route: route.abort())
    live(life, 6)
    expect(page.locator("#now-tick")).to_have_text("18")
    page.wait_for_timeout(3000)  # what is told of the run has been told
    expect(now).to_contain_text("Tick 12")
    page.unroute_all()
    expect(now).to_contain_text("Tick 18")


@pytest.mark.slow
def test_a_snapshot_that_is_stored_after_what_tells_of_its_tick_is_found_a_little_later(
    tabs: BrowserTabs, life: RunSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing more is told of the run: the page looks once more by itself."""
    monkeypatch.setattr(writer, "GROWTH", 1000.0)  # a slow machine stores one amid the ticks otherwise
    live(life, 12)
    page = tabs.open("/levels")
    page.clock.install()
    page.goto(tabs.address + "/runs/1")
    now = page.locator("#seen-at")
    expect(now).to_contain_text("Tick 12")
    page.clock.pause_at(datetime.now(UTC) + timedelta(minutes=1))  # else a slow machine looks again
    page.clock.run_for(10_000)  # what was told at the start has been looked at, and once more
    for _ in range(6):
        life.tick(watch(life.db, [1])[1])
    report_progress(life.db, life.claim, tick=18)
    expect(page.locator("#now-tick")).to_have_text("18")
    with page.expect_response(re.compile(r"/board\?")):
        page.clock.run_for(1000)
    life.board.write(life.saved)
    expect(now).to_contain_text("Tick 12")
    page.clock.run_for(3000)
    expect(now).to_contain_text("Tick 18")

"""The form offers weights that are missing: pre-trained now, or a beginning without them."""

from __future__ import annotations

import re

import httpx2
import pytest
from playwright.sync_api import Page, expect

from parenting.server import jobs
from parenting.server.db import Database
from parenting.server.errors import LostClaimError
from parenting.server.runs import get_run, list_runs
from parenting.server.weights import put_bytes
from parenting.server.workers import sign
from parenting.weights.policy_file import pack
from tests.pages.axe import violated
from tests.pages.browser_tabs import BrowserTabs
from tests.server.test_pretraining import HALL

FORM = {"world": "interruptibility", "level_text": HALL, "preset": "lax", "parent": "scripted", "seed": "5"}
FILE = "interruptibility-7x8-v1.safetensors"


def done(db: Database) -> None:
    """A worker pre-trains and stores weights; which ones they are does not matter to pages."""
    (mine,) = jobs.claim(db, "a", 1)
    put_bytes(db, FILE, b"weights")
    jobs.finish(db, mine, {"steps": 3})


def offered(tabs: BrowserTabs, screen: tuple[int, int]) -> Page:
    """The form with a level of another size, sent."""
    tabs.expected = ("422",)
    size = {"width": screen[0], "height": screen[1]}
    page = tabs.open("/", viewport=size, color_scheme="dark" if screen[0] < 400 else "light")
    page.locator(".fields #world").select_option("interruptibility")
    expect(page.locator(".fields [name=preset]:checked")).to_have_value("conservative")  # as it offers
    page.locator("details", has_text="Paste or draw").locator("summary").click()
    page.locator("#level_text").fill("".join(f"  {row}\n" for row in HALL.splitlines()))
    expect(page.locator("#level_text-told")).to_have_text("2 blank columns left of the art were cut.")
    page.get_by_role("button", name="Start", exact=True).click()
    page.get_by_role("button", name="Pre-train now (about 30 s)").wait_for()
    return page


def test_a_form_without_weights_offers_both_and_begins_without(client: httpx2.Client, db: Database) -> None:
    page = client.post("/runs", data=FORM)
    assert page.status_code == 422
    assert "Pre-train now (about 30 s)</button>" in page.text
    assert "parenting pretrain" not in page.text
    wrong = client.post("/runs", data={**FORM, "seed": "many"}).text
    assert "Pre-train now" not in wrong  # what else is wrong comes first
    assert not list_runs(db)
    started = client.post("/runs", data={**FORM, "config.pretrain": "false"})
    assert started.status_code == 303
    assert (get_run(db, 1).config["pretrain"], get_run(db, 1).weights) == (False, None)


def test_without_a_script_the_page_is_looked_at_again_until_the_run_begins(
    client: httpx2.Client, db: Database
) -> None:
    page = client.post("/pretraining", data=FORM).text
    job = re.findall(r'name="pretraining" value="(\w+)"', page)[0]
    assert "No worker is running." in page
    assert f'value="{job}"' in client.post("/pretraining", data={**FORM, "pretraining": job}).text
    (mine,) = jobs.claim(db, "a", 1)
    jobs.fail(db, mine, "The worker could not do this (pretrain): no memory")
    failed = client.post("/pretraining", data={**FORM, "pretraining": job}).text
    assert "no memory" in failed
    assert 'name="pretraining"' not in failed
    client.post("/pretraining", data=FORM)
    done(db)
    started = client.post("/pretraining", data={**FORM, "pretraining": job})
    run = get_run(db, 1)
    assert (started.status_code, started.headers["location"]) == (303, f"/runs/{run.public_id}")
    assert (run.seed, run.preset, run.config["pretrain"]) == (5, "lax", True)
    assert run.weights is not None


@pytest.mark.slow
def test_its_steps_are_shown_survive_a_reload_and_it_is_cancelled(tabs: BrowserTabs, db: Database) -> None:
    page = offered(tabs, (1280, 800))
    page.get_by_role("button", name="Pre-train now (about 30 s)").click()
    page.locator("#told").wait_for()
    sign(db, "a")
    (mine,) = jobs.claim(db, "a", 1)
    jobs.tell(db, mine, {"steps": 400, "expected": 1600, "seconds": 10.0})
    told = page.locator("#told")
    expect(told).to_have_text("400 of about 1,600 steps, about 30 s left.")
    expect(page.get_by_role("progressbar", name="Steps of pre-training")).to_have_js_property("value", 0.25)
    page.reload()
    expect(told).to_have_text(re.compile("400 of about 1,600 steps"))
    jobs.tell(db, mine, {"steps": 1700, "expected": 1600, "seconds": 40.0})
    expect(told).to_have_text("1,700 of about 1,600 steps, it takes longer than most.")
    assert violated(page) == []
    page.get_by_role("button", name="Cancel").click()
    expect(page.locator("#level_text")).to_have_value(re.compile("# I    #"))
    with pytest.raises(LostClaimError):
        jobs.tell(db, mine, {"steps": 1800, "expected": 1600, "seconds": 45.0})
    assert not list_runs(db)


@pytest.mark.slow
def test_in_a_browser_a_policy_is_taken_as_soon_as_it_is_chosen(tabs: BrowserTabs) -> None:
    """The form comes again with what was typed; no run begins with a policy that does not fit."""
    tabs.expected = ("422",)
    page = tabs.open("/", viewport={"width": 320, "height": 568}, color_scheme="dark")
    page.locator(".fields #seed").fill("77")
    page.locator("summary", has_text="Begin with an earlier policy").click()
    about = {"world": "side-effects", "levels": [], "config": {}, "stage": 1, "seed": 0}
    blob = pack(bytes(40), "float32", about)
    page.locator("#policy_file").set_input_files(
        {"name": "careful.safetensors", "mimeType": "application/octet-stream", "buffer": blob}
    )
    expect(page.get_by_role("checkbox", name="The policy careful.safetensors")).to_be_checked()
    expect(page.locator(".fields #seed")).to_have_value("77")
    assert violated(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 320
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.locator("#world-error")).to_have_text(re.compile("The policy is of the world side-effects"))
    expect(page.get_by_role("checkbox", name="The policy careful.safetensors")).to_be_checked()


@pytest.mark.slow
def test_in_a_browser_it_begins_without(tabs: BrowserTabs, db: Database) -> None:
    page = offered(tabs, (1280, 800))
    page.get_by_role("button", name="Begin without").click()
    page.wait_for_url("**/parent")
    assert get_run(db, 1).config["pretrain"] is False


@pytest.mark.slow
@pytest.mark.parametrize("screen", [(1280, 800), (320, 568)])
def test_in_a_browser_the_run_begins_by_itself(
    tabs: BrowserTabs, db: Database, screen: tuple[int, int]
) -> None:
    page = offered(tabs, screen)
    assert violated(page) == []
    page.get_by_role("button", name="Pre-train now (about 30 s)").click()
    expect(page.locator("#told")).to_have_text(re.compile("No worker is running"))
    assert violated(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= screen[0]
    done(db)
    page.wait_for_url("**/parent")
    assert get_run(db, 1).level_text.endswith(HALL)

"""The whole way through: a person raises the first agent by keyboard, with ten answers at most."""

from __future__ import annotations

from pathlib import Path

import httpx2
import pytest
from playwright.sync_api import Browser, expect

from tests.access import cookies_in
from tests.pages.browser_tabs import BrowserTabs
from tests.simulated_person import answer, distances, up

CHOICES = {"a": "left", "b": "right", "e": "either", "n": "neither"}
ENOUGH = 10


@pytest.mark.faults
@pytest.mark.timeout(900)
def test_the_first_agent_is_raised_by_at_most_ten_answers(browser: Browser, tmp_path: Path) -> None:
    with up(tmp_path) as url:
        tabs = BrowserTabs(browser, url, cookies_in(tmp_path, url))
        page = tabs.open("/")
        page.get_by_role("button", name="Raise your first agent").click()
        page.wait_for_selector("#main[data-run]")
        dashboard = tabs.open("/runs/1")
        to_goal = distances()
        keys: list[str] = []
        while page.locator("#optimal").is_hidden() and len(keys) < ENOUGH:  # told once a second at most
            keys.append(answer(page, to_goal))
        expect(page.locator("#optimal")).to_be_visible(timeout=60_000)
        run = httpx2.get(f"{url}/api/v1/runs/1").json()
        rows = httpx2.get(f"{url}/api/v1/runs/1/metrics").json()["rows"]
        assert run["status"] == "active"
        returns = [(row["values"]["return"], row["values"]["optimal_return"]) for row in rows]
        assert any(own == pytest.approx(best) for own, best in returns)  # it may be lost again meanwhile
        assert rows[-1]["values"]["deaths"] <= 1
        # What was answered is what was pressed: every key is stored once, in its order.
        assert run["answers"] == len(keys)
        asked = httpx2.get(f"{url}/api/v1/runs/1/queries", params={"limit": 200}).json()["rows"]
        answered = sorted((row["answer"] for row in asked if row["answer"]), key=lambda one: one["number"])
        assert [one["choice"] for one in answered] == [CHOICES[key] for key in keys]
        # What the agent heard until its last measurement is counted, each answer as what it was.
        measured = rows[-1]["values"]
        heard = [
            one["choice"]
            for one in answered
            if one["applied_tick"] and one["applied_tick"] <= rows[-1]["tick"]
        ]
        assert {name: measured[name] for name in CHOICES.values()} == {
            name: heard.count(name) for name in CHOICES.values()
        }
        assert "optimal" in dashboard.inner_text("main").lower()
        tabs.close()
        assert tabs.wrong == []

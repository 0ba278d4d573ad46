"""The whole way through: a person raises an agent on the island by keyboard until it is optimal."""

from __future__ import annotations

from pathlib import Path

import httpx2
import pytest
from playwright.sync_api import Browser

from tests.pages.browser_tabs import BrowserTabs
from tests.simulated_person import answer, distances, start, up


@pytest.mark.timeout(300)
def test_an_agent_is_raised_by_keyboard(browser: Browser, tmp_path: Path) -> None:
    with up(tmp_path) as url:
        tabs = BrowserTabs(browser, url)
        page = tabs.open("/")
        start(page, url)
        dashboard = tabs.open("/runs/1")
        to_goal = distances()
        keys: list[str] = []
        while page.locator("#optimal").is_hidden():
            assert len(keys) < 150, "the agent did not become optimal"
            keys.append(answer(page, to_goal))
        run = httpx2.get(f"{url}/api/v1/runs/1").json()
        rows = httpx2.get(f"{url}/api/v1/runs/1/metrics").json()["rows"]
        assert run["optimal"]
        assert run["status"] == "active"
        assert rows[-1]["values"]["return"] == pytest.approx(rows[-1]["values"]["optimal_return"])
        assert rows[-1]["values"]["deaths"] <= 1
        # What was answered is what was pressed: every key is stored once.
        counts = {name: rows[-1]["values"][name] for name in ("left", "right", "either", "neither")}
        pressed = [keys.count(key) for key in ("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown")]
        assert run["answers"] == len(keys)
        assert all(counted <= count for counted, count in zip(counts.values(), pressed, strict=True))
        assert "optimal" in dashboard.inner_text("main").lower()
        tabs.close()
        assert tabs.wrong == []

"""The dashboard's charts of a long life: few points at first, all of a part that is looked at closely."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, expect

from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.progress import report_progress
from parenting.server.runs import Claim
from tests.pages.browser_tabs import BrowserTabs, until

ROWS = 3_000
LOSS = "[data-chart=loss] .plot"


def rows(begin: int, end: int) -> dict[int, dict[str, float]]:
    same = {"return": 1.0, "optimal_return": 2.0, "maturity": 1}
    return {
        tick: {"loss": float(tick * 7919 % 1009), "deaths": tick // 100, **same} for tick in range(begin, end)
    }


def drawn(page: Page) -> list[list[float]]:
    """The points of the loss, as Plotly holds them."""
    page.wait_for_selector(f"{LOSS} .scatterlayer path")
    found: list[list[float]] = page.locator(LOSS).evaluate("plot => [plot.data[0].x, plot.data[0].y]")
    return found


@pytest.mark.slow
def test_a_long_life_is_drawn_by_few_points_until_it_is_looked_at(
    tabs: BrowserTabs, db: Database, mine: Claim
) -> None:
    write_metrics(db, mine, rows(0, ROWS))
    report_progress(db, mine, tick=ROWS - 1)
    page = tabs.open("/runs/1")
    x, y = drawn(page)
    assert 500 < len(x) <= 2_000
    assert (max(y), min(y), x[0], x[-1]) == (1008, 0, 0, ROWS - 1)
    page.locator(LOSS).evaluate(
        "plot => Plotly.relayout(plot, {'xaxis.range[0]': 1000.5, 'xaxis.range[1]': 1200.5})"
    )
    inside = "plot => plot.data[0].x.filter(tick => tick > 1000 && tick < 1201).length === 200"
    until(lambda: page.locator(LOSS).evaluate(inside))
    x, y = drawn(page)
    assert len(x) < 2_500
    assert x == sorted(x)
    assert all(y[at] == tick * 7919 % 1009 for at, tick in enumerate(x))
    write_metrics(db, mine, rows(ROWS, ROWS + 5))
    report_progress(db, mine, tick=ROWS + 4)
    until(lambda: drawn(page)[0][-1] == ROWS + 4)
    expect(page.locator("#now-deaths")).to_have_text(str((ROWS + 4) // 100))
    page.locator(LOSS).evaluate("plot => Plotly.relayout(plot, {'xaxis.autorange': true})")
    until(lambda: not page.locator(LOSS).evaluate(inside))

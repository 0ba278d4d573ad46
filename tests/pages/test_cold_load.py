"""The parent's page comes in few and small responses, counted by the browser with their headers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Browser, Route, expect

from parenting.server.db import Database
from tests.access import cookies
from tests.pages.parent_page import shown

LOADED, MOST = 15_000, 5
"""Bytes of all responses until the first question is painted, and their number."""


@pytest.mark.parametrize("kind", ["guidance", "preference"])
def test_first_question_is_on_the_screen_after_few_small_responses(
    browser: Browser, address: str, db: Database, ask: Callable[..., int], kind: str
) -> None:
    number = ask(kind)
    context = browser.new_context()
    context.add_cookies(cookies(db, address))
    tab = context.new_page()
    network = context.new_cdp_session(tab)
    addresses: dict[str, str] = {}
    sizes: dict[str, int] = {}
    later: list[Route] = []

    def finished(event: dict[str, Any]) -> None:
        sizes[addresses[event["requestId"]]] = event["encodedDataLength"]

    network.on(
        "Network.requestWillBeSent",
        lambda event: addresses.update({event["requestId"]: event["request"]["url"]}),
    )
    network.on("Network.loadingFinished", finished)
    network.send("Network.enable")
    # held: the question does not need it
    tab.route("**/static/parent-*.js", lambda route: later.append(route))
    tab.goto(f"{address}/runs/1/parent")
    expect(tab.locator("#question")).to_be_visible()
    tab.evaluate("new Promise(then => requestAnimationFrame(() => requestAnimationFrame(then)))")
    while not later:
        tab.wait_for_timeout(20)
    assert all(one.startswith(address) for one in addresses.values())
    endings = sorted(one.rpartition(".")[2] for one in sizes if "/static/" in one)
    assert endings[:2] == ["css", "js"], "one style sheet, one script"
    assert set(endings[2:]) <= {"svg"}, "and the icon, which the browser may fetch later"
    assert [one for one in sizes if one.endswith("/question")], "the question is counted, too"
    assert len(sizes) <= MOST, sizes
    assert sum(sizes.values()) <= LOADED, sizes
    later[0].continue_()
    shown(tab, number)
    context.close()

"""The parent's page comes in few and small responses, counted by the browser with their headers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from playwright.sync_api import Browser, expect

PAINTED, LOADED, MOST = 15_000, 24_000, 5
"""Bytes that the painting of the question needs (page and style), bytes with script and icon, and responses.

What the script then asks for (the state, the next question, the stream) is not counted.
"""


def test_first_question_is_on_the_screen_after_few_small_responses(
    browser: Browser, address: str, ask: Callable[..., int]
) -> None:
    ask("preference")
    ask("guidance")
    context = browser.new_context()
    tab = context.new_page()
    network = context.new_cdp_session(tab)
    addresses: dict[str, str] = {}
    sizes: dict[str, int] = {}

    def finished(event: dict[str, Any]) -> None:
        sizes[addresses[event["requestId"]]] = event["encodedDataLength"]

    network.on(
        "Network.requestWillBeSent",
        lambda event: addresses.update({event["requestId"]: event["request"]["url"]}),
    )
    network.on("Network.loadingFinished", finished)
    network.send("Network.enable")
    tab.goto(f"{address}/runs/1/parent")
    expect(tab.locator("#question")).to_be_visible()
    tab.evaluate("new Promise(then => requestAnimationFrame(() => requestAnimationFrame(then)))")
    context.close()
    assert all(one.startswith(address) for one in addresses.values())
    loaded = {one: size for one, size in sizes.items() if "/static/" in one or one.endswith("/parent")}
    needed = [size for one, size in loaded.items() if not one.endswith((".js", ".svg"))]
    endings = sorted(one.rpartition(".")[2] for one in loaded if "/static/" in one)
    assert endings[:2] == ["css", "js"], "one style sheet, one script"
    assert set(endings[2:]) <= {"svg"}, "and the icon, which the browser may fetch later"
    assert len(loaded) <= MOST, loaded
    assert (len(needed), sum(needed) <= PAINTED) == (2, True), loaded
    assert sum(loaded.values()) <= LOADED, loaded

"""`parenting up --public` as a whole: behind a proxy of docs/operations.md, in a browser, with a worker."""

from __future__ import annotations

import http.client
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from subprocess import Popen
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from tests import proxies
from tests.pages.browser_tabs import until
from tests.pages.conftest import FLAGS
from tests.pages.traffic import Traffic
from tests.server.serving import free_port, parenting

HOST_RULES = f"--host-resolver-rules=MAP {proxies.NAME} 127.0.0.1"


@pytest.fixture
def chromium(chromium_path: str) -> Iterator[Browser]:
    """A browser that finds the name of the public server at this machine."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path, args=[*FLAGS, HOST_RULES])
        yield browser
        browser.close()


@contextmanager
def public(folder: Path, port: int) -> Iterator[tuple[Popen[str], str]]:
    """`parenting up --public`, and the address that it prints."""
    options = ["up", "--public", "--no-browser", "--workers", "1", "--port", str(port)]
    with parenting(*options, data=folder, PARENTING_HOSTS=proxies.NAME) as up:
        assert up.stdout is not None
        words = up.stdout.readline().split()
        assert words, up.communicate()[1]
        yield up, next(word for word in words if "/open?token=" in word)


@pytest.mark.slow
@pytest.mark.torture
@pytest.mark.parametrize("program", list(proxies.COMMANDS))
def test_a_public_server_is_entered_and_an_agent_raised_through_its_proxy(
    program: str, chromium: Browser, tmp_path: Path
) -> None:
    """Web, worker, proxy and browser are started, torch included: half a minute."""
    port, folder = free_port(), tmp_path / "proxy"
    folder.mkdir()
    with public(tmp_path, port) as (up, address), proxies.proxy(program, folder, port, "none") as client:
        assert address.startswith(f"https://{proxies.NAME}/open?token=po_")
        page = entered(chromium, address.replace(proxies.NAME, client.headers["host"]))
        (cookie,) = [one for one in page.context.cookies() if one["name"].startswith("parenting_session_")]
        assert (cookie["secure"], cookie["httpOnly"], cookie["sameSite"]) == (True, True, "Lax")
        raise_one(page)
        page.context.close()  # Caddy waits for its connections
        assert forged(port, f"{cookie['name']}={cookie['value']}") == 403
        up.terminate()
        assert up.wait(60) == 0


def entered(chromium: Browser, address: str) -> Page:
    page = chromium.new_context(ignore_https_errors=True).new_page()
    page.set_default_timeout(60_000)
    page.goto(address)
    expect(page.get_by_role("button", name="Raise your first agent")).to_be_visible(timeout=60_000)
    return page


def raise_one(page: Page) -> None:
    """Answer two questions of a new agent; its stream lies open meanwhile."""
    traffic = Traffic()
    traffic.watch(page.context)
    page.get_by_role("button", name="Raise your first agent").click()
    former = ""
    for number in ("1", "2"):
        question = page.locator(f'#question[data-listening]:not([data-query="{former}"])')
        expect(question).to_be_visible(timeout=120_000)
        former = question.get_attribute("data-query") or ""
        page.keyboard.press("b")
        expect(page.locator("#count")).to_have_text(number, timeout=60_000)

    def streamed() -> bool:
        page.wait_for_timeout(20)  # Playwright tells of requests while it is called
        return "stream" in traffic.lying()

    until(streamed)


def forged(port: int, cookie: str) -> int:
    """The status of a request beside the proxy that names a client and https, from another address."""
    connection = http.client.HTTPConnection("127.0.0.1", port, source_address=("127.0.0.2", 0), timeout=30)
    told: dict[str, Any] = {"X-Forwarded-For": "192.0.2.1", "X-Forwarded-Proto": "https"}
    connection.request("GET", "/", headers={"Host": proxies.NAME, "Cookie": cookie, **told})
    status = connection.getresponse().status
    connection.close()
    return status

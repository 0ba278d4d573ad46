"""Firefox, driven by WebDriver BiDi over --remote-debugging-port: commands in JSON over one WebSocket."""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import threading
import time
from collections.abc import Coroutine, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, TypeVar

from tornado.websocket import WebSocketClientConnection, websocket_connect

PATIENCE = 30.0
"""Seconds for one command, and for the browser to start."""
LISTENS = re.compile(r"WebDriver BiDi listening on (ws://\S+)")
SETTINGS = {
    "app.update.disabledForTesting": True,
    "browser.shell.checkDefaultBrowser": False,
    "browser.startup.homepage_override.mstone": "ignore",
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "toolkit.telemetry.enabled": False,
}
"""No word goes to other hosts, and no page opens by itself."""


T = TypeVar("T")


class BidiError(Exception):
    """The browser refused a command."""


class Loop:
    """An event loop in a thread of its own: Playwright may run one in the thread of the tests."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever)
        self.thread.start()

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        """Return the result of a coroutine, within `PATIENCE`."""
        return asyncio.run_coroutine_threadsafe(work, self.loop).result(PATIENCE)

    def close(self) -> None:
        """End the loop and its thread."""
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join()
        self.loop.close()


class Firefox:
    """A running Firefox. `wrong` lists errors and warnings of its consoles, and requests to other hosts."""

    def __init__(self, loop: Loop, socket: WebSocketClientConnection, address: str) -> None:
        self.loop, self.socket, self.address = loop, socket, address
        self.number = 0
        self.wrong: list[str] = []
        self.call("session.new", capabilities={})
        self.call("session.subscribe", events=["log.entryAdded", "network.beforeRequestSent"])

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and return its result.

        Raises:
            BidiError: the browser refused it.
        """
        return self.loop.run(self._call(method, parameters))

    def open(self, path: str) -> FirefoxTab:
        """A new tab that has loaded a page."""
        context = self.call("browsingContext.create", type="tab")["context"]
        self.call("browsingContext.navigate", context=context, url=self.address + path, wait="complete")
        return FirefoxTab(self, context)

    async def _call(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        self.number += 1
        await self.socket.write_message(
            json.dumps({"id": self.number, "method": method, "params": parameters})
        )
        while (text := await self.socket.read_message()) is not None:
            message = json.loads(text)
            if message.get("id") == self.number:
                if message["type"] == "error":
                    raise BidiError(f"{method}: {message['message']}")
                result: dict[str, Any] = message["result"]
                return result
            self._heard(message)
        raise BidiError(f"{method}: the connection was closed")

    def _heard(self, message: dict[str, Any]) -> None:
        told = message.get("params", {})
        if message.get("method") == "log.entryAdded" and told["level"] in ("error", "warn"):
            self.wrong.append(told["text"])
        if message.get("method") == "network.beforeRequestSent":
            url = told["request"]["url"]
            if not url.startswith((self.address, "data:", "blob:", "about:")):
                self.wrong.append(f"a request to {url}")


class FirefoxTab:
    """A tab, in which a person presses keys and clicks."""

    def __init__(self, firefox: Firefox, context: str) -> None:
        self.firefox, self.context = firefox, context

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression of JavaScript: text, number, true or false."""
        result = self._evaluated(expression)
        return result.get("value")

    def wait(self, expression: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + PATIENCE
        while self.evaluate(f"!!({expression})") is not True:
            assert time.monotonic() < end, f"{expression}: it did not happen"
            time.sleep(0.05)

    def press(self, key: str) -> None:
        """Press a key."""
        keys = [{"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]
        self._act({"type": "key", "id": "keyboard", "actions": keys})

    def click(self, selector: str) -> None:
        """Click the middle of an element."""
        element = self._evaluated(f"document.querySelector({json.dumps(selector)})")
        origin = {"type": "element", "element": {"sharedId": element["sharedId"]}}
        moves = [
            {"type": "pointerMove", "x": 0, "y": 0, "origin": origin},
            {"type": "pointerDown", "button": 0},
            {"type": "pointerUp", "button": 0},
        ]
        self._act({"type": "pointer", "id": "mouse", "actions": moves})

    def reload(self) -> None:
        """Load the page again."""
        self.firefox.call("browsingContext.reload", context=self.context, wait="complete")

    def activate(self) -> None:
        """Bring the tab to the front."""
        self.firefox.call("browsingContext.activate", context=self.context)

    def _act(self, source: dict[str, Any]) -> None:
        self.firefox.call("input.performActions", context=self.context, actions=[source])

    def _evaluated(self, expression: str) -> dict[str, Any]:
        result = self.firefox.call(
            "script.evaluate", expression=expression, target={"context": self.context}, awaitPromise=True
        )
        if result["type"] != "success":
            raise BidiError(f"{expression}: {result['exceptionDetails']['text']}")
        value: dict[str, Any] = result["result"]
        return value


@contextmanager
def firefox(program: str, profile: Path, address: str) -> Iterator[Firefox]:
    """Start Firefox without a window, and end it."""
    lines = "".join(
        f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in SETTINGS.items()
    )
    (profile / "user.js").write_text(lines, encoding="utf-8")
    command = [
        program,
        "--headless",
        "--no-remote",
        "--profile",
        str(profile),
        "--remote-debugging-port",
        "0",
    ]
    log = profile / "log"
    with log.open("wb") as file, closing(Loop()) as loop:
        process = subprocess.Popen(command, stdout=file, stderr=file)
        try:
            socket = loop.run(_connected(_listening(process, log)))
            yield Firefox(loop, socket, address)
            loop.run(_closed(socket))
        finally:
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _listening(process: subprocess.Popen[bytes], log: Path) -> str:
    """Wait until the browser tells where it listens."""
    end = time.monotonic() + PATIENCE
    while (found := LISTENS.search(log.read_text(errors="replace"))) is None:
        assert process.poll() is None, f"Firefox ended: {log.read_text(errors='replace')[-500:]}"
        assert time.monotonic() < end, "Firefox did not listen"
        time.sleep(0.05)
    return f"{found[1]}/session"


async def _connected(url: str) -> WebSocketClientConnection:
    return await websocket_connect(url)


async def _closed(socket: WebSocketClientConnection) -> None:
    socket.close()

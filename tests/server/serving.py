"""Real processes for the tests of shutdown: how they are started, asked and watched."""

import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx2

from tests.access import seed
from tests.tree import ROOT


@contextmanager
def parenting(*arguments: str, data: Path, **more: str) -> Iterator[subprocess.Popen[str]]:
    """`parenting ...` as a process of its own, killed at the end if it still lives."""
    seed(data)
    environment = {**os.environ, "PARENTING_DATA": str(data), "PYTHONPATH": str(ROOT), **more}
    command = [sys.executable, "-P", "-m", "parenting.commands.main", *arguments]
    child = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=data
    )
    try:
        yield child
    finally:
        if child.poll() is None:
            child.kill()
        child.communicate()


def free_port() -> int:
    """A port that nobody listened on a moment ago."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port: int = listener.getsockname()[1]
        return port


def until_up(url: str, seconds: float = 60) -> None:
    """Wait until the server answers."""
    end = time.monotonic() + seconds
    while True:
        try:
            assert httpx2.get(f"{url}/healthz").status_code == 200
            return
        except httpx2.TransportError:
            assert time.monotonic() < end, "the server did not come up"
            time.sleep(0.05)


class Stream:
    """A browser's tab: an open stream, read in a thread."""

    def __init__(self, url: str) -> None:
        self.events: list[tuple[str, Any]] = []
        self.opened, self.ended = threading.Event(), threading.Event()
        self.headers: dict[str, str] = {}
        self._arrived = threading.Condition()
        self._closing = False
        threading.Thread(target=self._read, args=(url,), daemon=True).start()

    def _read(self, url: str) -> None:
        try:
            with httpx2.stream("GET", url, timeout=30) as reply:
                self.headers = {**reply.headers, "status": str(reply.status_code)}
                name = ""
                self.opened.set()
                for line in reply.iter_lines():
                    if line.startswith("event: "):
                        name = line[7:]
                    elif line.startswith("data: "):
                        self._add(name, json.loads(line[6:]))
                    if self._closing:
                        return
        except httpx2.TransportError:
            pass  # cut off, as a stopping server may
        finally:
            self.opened.set()
            self.ended.set()

    def _add(self, name: str, data: object) -> None:
        with self._arrived:
            self.events.append((name, data))
            self._arrived.notify_all()

    def wait_for(self, name: str, count: int = 1, seconds: float = 60) -> list[Any]:
        """The data of the events of that name, once there are `count` of them."""

        def found() -> list[Any]:
            return [data for event, data in self.events if event == name]

        with self._arrived:
            assert self._arrived.wait_for(lambda: len(found()) >= count, seconds), f"{name}: {self.events}"
            return found()

    def close(self) -> None:
        """Leave at the next line."""
        self._closing = True

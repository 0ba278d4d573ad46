"""A proxy that delivers a request and drops its reply: the client cannot know what became of it."""

from __future__ import annotations

import random
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import httpx2


class Dropping(ThreadingHTTPServer):
    """Listens on a free port and passes requests on; `dropped` counts the replies that it kept to itself."""

    daemon_threads = True

    def __init__(self, url: str, seed: float, chance: float) -> None:
        super().__init__(("127.0.0.1", 0), Passing)
        self.upstream, self.rng, self.chance = url, random.Random(seed), chance
        self.dropped = 0

    @property
    def url(self) -> str:
        """Return its address."""
        return f"http://127.0.0.1:{self.server_port}"


class Passing(BaseHTTPRequestHandler):
    """Passes one request on, and its reply back, or not."""

    protocol_version = "HTTP/1.1"
    server: Dropping

    def do_POST(self) -> None:
        """Deliver it; drop the reply by chance."""
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        kind = {"Content-Type": self.headers.get("Content-Type", "application/json")}
        try:
            address = f"{self.server.upstream}{self.path}"
            reply = httpx2.post(address, content=body, headers=kind, timeout=30, trust_env=False)
        except httpx2.TransportError:
            self.close_connection = True
            return
        if self.server.rng.random() < self.server.chance:
            self.server.dropped += 1
            self.close_connection = True
            return
        self.send_response(reply.status_code)
        self.send_header("Content-Type", reply.headers.get("Content-Type", "application/json"))
        if reply.status_code != 204:
            self.send_header("Content-Length", str(len(reply.content)))
        self.end_headers()
        self.wfile.write(reply.content)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


@contextmanager
def dropping(url: str, seed: float, chance: float = 0.3) -> Iterator[Dropping]:
    """A proxy before a server, for a while."""
    proxy = Dropping(url, seed, chance)
    thread = threading.Thread(target=proxy.serve_forever, daemon=True)
    thread.start()
    try:
        yield proxy
    finally:
        proxy.shutdown()
        proxy.server_close()
        thread.join()

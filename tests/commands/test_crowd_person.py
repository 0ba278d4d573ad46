"""One person of a crowd: what is sent, and what an address that does not answer is told as."""

from __future__ import annotations

import asyncio
import re
import socketserver
import ssl
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest

from parenting.commands.client import Client, RefusedError, UnavailableError
from parenting.commands.crowd_person import Person, trust
from parenting.commands.errors import UsageError
from parenting.server.access.credentials import Credentials
from parenting.server.access.key import SECONDS, holds, make_key
from tests.server.serving import free_port


class Answering(socketserver.TCPServer):
    """A server that gives one reply to everybody, and keeps what was sent to it."""

    def __init__(self, reply: bytes) -> None:
        self.reply, self.heard = reply, list[bytes]()
        super().__init__(("127.0.0.1", 0), Reading)
        self.url = f"http://127.0.0.1:{self.server_address[1]}/under"
        threading.Thread(target=self.serve_forever, args=(0.01,), daemon=True).start()


class Reading(socketserver.StreamRequestHandler):
    """The requests of a connection, one after another."""

    def handle(self) -> None:
        """Read each until its client goes, or says something else than HTTP."""
        server = self.server
        assert isinstance(server, Answering)
        while (first := self.rfile.readline()).endswith(b"HTTP/1.1\r\n"):
            lines = [first, *iter(self.rfile.readline, b"\r\n")]
            lengths = [
                int(line.split(b":")[1]) for line in lines if line.lower().startswith(b"content-length")
            ]
            server.heard.append(b"".join(lines) + b"\r\n" + self.rfile.read(sum(lengths)))
            self.wfile.write(server.reply)


@pytest.fixture
def answering(request: pytest.FixtureRequest) -> Iterator[Answering]:
    status, body = request.param
    head = f"HTTP/1.1 {status}\r\ncontent-type: application/json\r\ncontent-length: {len(body)}\r\n\r\n"
    server = Answering(head.encode() + body)
    yield server
    server.shutdown()
    server.server_close()


def client_of(url: str) -> Client:
    return Client(url, httpx2.Client(trust_env=False, auth=Credentials("a-token", Path())))


def sent(url: str, path: str, body: dict[str, Any] | None) -> Any:
    async def send() -> Any:
        async with Person(client_of(url), "ann", trust(client_of(url))) as person:
            await person.get("runs/1")
            return await person.post(path, None if body is None else person.said(**body))

    return asyncio.run(send())


@pytest.mark.parametrize("answering", [("200 OK", b'{"a":1}')], indirect=True)
def test_requests_carry_name_credentials_and_body_over_one_connection(answering: Answering) -> None:
    assert sent(answering.url, "queries/7/answer", {"choice": "left"}) == {"a": 1}
    asked, told = answering.heard  # the server accepts one connection, and both came over it
    assert asked.startswith(b"GET /under/api/v1/runs/1 HTTP/1.1\r\n")
    assert told.startswith(b"POST /under/api/v1/queries/7/answer HTTP/1.1\r\n")
    for request in (asked, told):
        lines = request.split(b"\r\n\r\n")[0].lower().split(b"\r\n")
        for line in (b"authorization: bearer a-token", b"cookie: parenting_client=ann"):
            assert lines.count(line) == 1
        assert any(line.startswith(b"accept-encoding: gzip") for line in lines), "as a browser asks"
    assert b"content-length" not in asked.lower()
    head, body = told.split(b"\r\n\r\n")
    assert body == b'{"client_id":"ann","choice":"left"}'
    assert f"content-length: {len(body)}".encode() in head.lower()
    assert b"content-type: application/json" in head.lower()


@pytest.mark.parametrize("answering", [("200 OK", b'{"a":1}')], indirect=True)
def test_each_request_has_a_proof_of_its_own_time(
    answering: Answering, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One proof would be too old after five minutes."""
    key, clock = make_key(tmp_path), [1_800_000_000.0]
    monkeypatch.setattr("parenting.server.access.key.time.time", lambda: clock[0])
    client = Client(answering.url, httpx2.Client(trust_env=False, auth=Credentials(None, tmp_path)))

    async def send() -> None:
        async with Person(client, "ann", None) as person:
            for _ in range(3):
                await person.get("runs/1")
                clock[0] += 2 * SECONDS

    asyncio.run(send())
    port = int(answering.server_address[1])
    for number, request in enumerate(answering.heard):
        (proof,) = re.findall(rb"(?i)authorization: bearer (\S+)", request)
        assert holds(key, port, proof.decode(), 1_800_000_000.0 + 2 * SECONDS * number)


@pytest.mark.parametrize(
    ("answering", "error", "sentence"),
    [
        (("404 Not Found", b"nothing"), UsageError, "it answers 404 at /under/api/v1/runs/1."),
        (("409 Conflict", b'{"error": {"message": "Too late."}}'), RefusedError, "Too late."),
        (("503 Busy", b"{}"), UnavailableError, "answers 503"),
    ],
    indirect=["answering"],
)
def test_refusals_are_told_as_to_other_commands(
    answering: Answering, error: type[Exception], sentence: str
) -> None:
    with pytest.raises(error, match=sentence):
        sent(answering.url, "runs/1/end-episode", None)


@pytest.mark.parametrize(("scheme", "secure"), [("http", False), ("https", True), ("HTTPS", True)])
def test_certificates_are_checked_by_what_httpx_trusts(scheme: str, secure: bool) -> None:
    found = trust(client_of(f"{scheme}://a-server"))
    assert (found is not None) == secure
    if found is not None:
        assert found.check_hostname
        assert found.verify_mode is ssl.CERT_REQUIRED


@pytest.mark.parametrize("scheme", ["http", "https"])
def test_a_server_that_is_away_may_come_back(scheme: str) -> None:
    with pytest.raises(UnavailableError, match="No server answers"):
        sent(f"{scheme}://127.0.0.1:{free_port()}", "runs", None)


@pytest.mark.parametrize("answering", [("200 OK", b"{}")], indirect=True)
def test_a_server_that_does_not_speak_tls_is_no_traceback(answering: Answering) -> None:
    with pytest.raises(UnavailableError, match="No server answers"):
        sent(answering.url.replace("http:", "https:"), "runs", None)

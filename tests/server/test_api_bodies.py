"""Malformed bodies are refused with a remedy; none is echoed, none is too large."""

import json
from collections.abc import Callable
from typing import Any

import httpx2
import pytest

from parenting.server.app import LARGEST_BODY
from tests.server.test_api import WORLD, start, wrong

pytestmark = pytest.mark.only("sqlite", "such bodies are refused before the store is asked")


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"[]",
        b"3",
        b'{"world": NaN}',
        b'{"world": "\\ud800"}',
        b"\xff\xfe",
        b'{"seed": 1e999}',
        b"null",
    ],
)
def test_malformed_body_is_refused(client: httpx2.Client, body: bytes) -> None:
    reply = client.post("/api/v1/runs", content=body, headers={"Content-Type": "application/json"})
    assert wrong(reply)


@pytest.mark.parametrize(
    ("body", "media", "said"),
    [
        (b"{", "application/json", "not JSON"),
        (b'"\xff"', "application/json", "UTF-8"),
        (b"[]", "application/json", "a JSON object"),
        (b"{}", "text/plain", "Content-Type: application/json"),
    ],
)
def test_body_that_is_none_is_told_so(client: httpx2.Client, body: bytes, media: str, said: str) -> None:
    reply = client.post("/api/v1/runs", content=body, headers={"Content-Type": media})
    assert said in wrong(reply)["body"]


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e400", "1" * 400])
def test_numbers_out_of_reach_are_refused(client: httpx2.Client, number: str) -> None:
    body = f'{{"world": "{WORLD}", "config": {{"p_guid": {number}}}}}'
    reply = client.post("/api/v1/runs", content=body, headers={"Content-Type": "application/json"})
    assert wrong(reply).keys() == {"config.p_guid"}


def test_error_echoes_nothing(client: httpx2.Client) -> None:
    assert "hunter2" not in start(
        client, parent="hunter2", config={"hunter2x": "hunter2"}, seed="hunter2"
    ).text.replace("hunter2x", "")


@pytest.mark.parametrize(
    ("path", "body", "field"),
    [
        ("queries/1/answer", b'{"choice": "left", "choice": "right", "client_id": "me"}', "choice"),
        ("runs/1/queries/lease", b'{"client_id": "me", "client_id": "me"}', "client_id"),
        ("runs", b'{"world": "W", "config": {"p_rec": 0.1, "p_rec": 0.2}}', "p_rec"),
        ("runs", b'{"\\u0000": 1, "\\u0000": 2}', "body"),
        ("runs", b'{"\\ud800": 1, "\\ud800": 2}', "body"),
    ],
)
def test_a_field_that_stands_twice_is_refused(
    client: httpx2.Client, guidance: int, path: str, body: bytes, field: str
) -> None:
    headers = {"Content-Type": "application/json"}
    refused = wrong(client.post(f"/api/v1/{path}", content=body, headers=headers))
    assert refused == {field: "It stands twice in this body. Send it once."}
    assert client.get(f"/api/v1/queries/{guidance}").json()["answer"] is None


def sized(size: int) -> bytes:
    return json.dumps({"world": WORLD, "name": "x" * size}).encode()


def pieces(body: bytes) -> Callable[[], Any]:
    def stream() -> Any:
        yield from (body[i : i + 1000] for i in range(0, len(body), 1000))

    return stream


def test_large_body_is_refused_with_and_without_length(client: httpx2.Client) -> None:
    headers = {"Content-Type": "application/json"}
    for content in (sized(LARGEST_BODY), pieces(sized(LARGEST_BODY))()):
        refused = client.post("/api/v1/runs", content=content, headers=headers)
        assert (refused.status_code, refused.json()["error"]["code"]) == (413, "too_large")
        assert f"may have {LARGEST_BODY} bytes" in refused.json()["error"]["message"]
    assert wrong(client.post("/api/v1/runs", content=pieces(sized(200))(), headers=headers)).keys() == {
        "name"
    }

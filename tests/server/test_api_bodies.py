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
    assert wrong(client.post("/api/v1/runs", content=pieces(sized(200))(), headers=headers)).keys() == {
        "name"
    }

"""The API's parameters are strict: no route passes over one that it does not know."""

from __future__ import annotations

import re

import httpx2
import pytest

from parenting.server.app import bare_app
from parenting.server.runs import Claim
from tests.server.test_api import wrong

pytestmark = pytest.mark.only("sqlite", "parameters are refused before the store is asked")

PATHS = bare_app().openapi()["paths"]
ROUTES = [(method, path) for path, found in PATHS.items() for method in found if path.startswith("/api/")]


@pytest.mark.slow_after(20)
@pytest.mark.parametrize(("method", "path"), ROUTES)
def test_an_unknown_parameter_is_refused(
    client: httpx2.Client, mine: Claim, guidance: int, method: str, path: str
) -> None:
    address = re.sub(r"\{\w+\}", "1", path)
    refused = wrong(client.request(method, address, params={"nonsense": "1"}))
    assert "nonsense" in refused
    assert "nonsense=1" not in str(refused)


@pytest.mark.slow_after(30)
@pytest.mark.parametrize("written", ["1_0", " 1", "+1", "1\n", "1.0", "\u0661", ""])
@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("runs", "limit"),
        ("runs", "before"),
        ("runs/1/metrics", "after"),
        ("runs/1/curves", "points"),
        ("runs/1/events", "after"),
        ("runs/1/board", "states"),
        ("runs/1/board/5", "stage"),
        ("runs/1/episodes", "before"),
        ("audit", "limit"),
        ("tombstones", "before"),
    ],
)
def test_whole_numbers_are_digits_alone(
    client: httpx2.Client, mine: Claim, path: str, name: str, written: str
) -> None:
    refused = wrong(client.get(f"/api/v1/{path}", params={name: written}))
    assert refused[name] == "Write a whole number in digits alone, such as 20."

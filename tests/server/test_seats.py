"""The live streams of one browser and of one client are limited."""

import pytest
from starlette.requests import Request

from parenting.server.errors import TooManyOfOneError
from parenting.server.seats import Seats


def request(client: str, browser: str = "") -> Request:
    headers = [(b"cookie", f"parenting_client={browser}".encode())] if browser else []
    return Request({"type": "http", "headers": headers, "client": (client, 1)})


def test_a_browser_has_so_many_streams_wherever_it_is() -> None:
    seats = Seats(per_browser=2, per_client=100)
    with seats.taken(request("127.0.0.1", "a")), seats.taken(request("192.0.2.1", "a")):
        with pytest.raises(TooManyOfOneError):
            seats.check(request("127.0.0.1", "a"))
        seats.check(request("127.0.0.1", "b"))
        seats.check(request("127.0.0.1"))
    seats.check(request("127.0.0.1", "a"))


def test_a_client_has_so_many_streams_but_for_loopback() -> None:
    seats = Seats(per_browser=100, per_client=1)
    here = seats.taken(request("127.0.0.1")), seats.taken(request("::1"))
    with seats.taken(request("192.0.2.1", "a")), here[0], here[1]:
        with pytest.raises(TooManyOfOneError):
            seats.check(request("192.0.2.1", "b"))
        for other in ("192.0.2.2", "127.0.0.1", "::1"):
            seats.check(request(other))
    seats.check(request("192.0.2.1"))


def test_a_refusal_is_429_with_a_sentence() -> None:
    body = TooManyOfOneError().body()
    assert TooManyOfOneError.status == 429
    assert body["error"]["code"] == "too_many"
    assert "Close" in body["error"]["message"]

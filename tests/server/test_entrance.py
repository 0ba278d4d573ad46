"""Under which names and by which ways a request may come in, and what is believed of a proxy."""

from __future__ import annotations

import httpx2
import pytest
from fastapi.testclient import TestClient
from starlette.types import Scope

from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.entrance import Entrance
from parenting.server.errors import ServerError
from parenting.server.settings import Settings

pytestmark = pytest.mark.only("sqlite", "such requests are refused before the store is asked")

NAME = "parenting.example"
HTTPS = {"x-forwarded-proto": "https", "x-forwarded-for": "192.0.2.7"}
PUBLIC = Settings(public=True, hosts=f"{NAME}, other.example", trusted_proxies="127.0.0.1, 10.0.0.0/24, ::1")


def scope(peer: str, host: str, told: dict[str, str] | list[tuple[str, str]]) -> Scope:
    headers = [("host", host), *(told.items() if isinstance(told, dict) else told)]
    lines = [(name.encode(), value.encode("latin-1")) for name, value in headers]
    return {"type": "http", "client": (peer, 50_000), "scheme": "http", "headers": lines}


def refusal(entrance: Entrance, one: Scope) -> type[ServerError] | str:
    error = entrance.enter(one)
    return "" if error is None else error.code


@pytest.mark.parametrize("peer", ["127.0.0.1", "10.0.0.9", "::1", "::ffff:127.0.0.1"])
def test_a_proxy_is_believed_who_its_client_is(peer: str) -> None:
    one = scope(peer, f"{NAME.upper()}:443", HTTPS)
    assert refusal(Entrance.of(PUBLIC), one) == ""
    assert (one["client"], one["scheme"]) == (("192.0.2.7", 0), "https")


@pytest.mark.parametrize(
    ("chain", "client"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("203.0.113.1, 192.0.2.7", "192.0.2.7"),
        ("127.0.0.1, 192.0.2.7", "192.0.2.7"),
        ("192.0.2.7, 10.0.0.3", "192.0.2.7"),
        ("10.0.0.8, 127.0.0.1", "10.0.0.8"),
        ("nobody, 2001:db8::1 ,10.0.0.3", "2001:db8::1"),
    ],
)
def test_of_a_chain_the_last_address_counts_that_is_not_a_proxy(chain: str, client: str) -> None:
    one = scope("127.0.0.1", NAME, {**HTTPS, "x-forwarded-for": chain})
    assert refusal(Entrance.of(PUBLIC), one) == ""
    assert one["client"][0] == client


@pytest.mark.parametrize(
    ("peer", "host", "told", "code"),
    [
        ("192.0.2.9", NAME, HTTPS, "plain_http"),  # forged, beside the proxy
        ("192.0.2.9", "localhost", {}, "plain_http"),
        ("10.0.1.1", NAME, HTTPS, "plain_http"),
        ("127.0.0.1", NAME, {}, "plain_http"),
        ("10.0.0.9", "localhost", {}, "plain_http"),
        ("127.0.0.1", NAME, {**HTTPS, "x-forwarded-proto": "http"}, "plain_http"),
        ("127.0.0.1", NAME, {"x-forwarded-for": "192.0.2.7"}, "plain_http"),
        ("127.0.0.1", NAME, [*HTTPS.items(), ("x-forwarded-proto", "https")], "plain_http"),
        ("127.0.0.1", NAME, {**HTTPS, "x-forwarded-proto": "https, http"}, "plain_http"),
        ("127.0.0.1", NAME, {"x-forwarded-proto": "https"}, "forwarded"),
        ("127.0.0.1", NAME, {**HTTPS, "x-forwarded-for": "somebody"}, "forwarded"),
        ("127.0.0.1", NAME, {**HTTPS, "x-forwarded-for": "192.0.2.7:80"}, "forwarded"),
        ("127.0.0.1", NAME, {**HTTPS, "x-forwarded-for": "somebody, 127.0.0.1"}, "forwarded"),
        ("127.0.0.1", "localhost", HTTPS, "unknown_host"),
        ("127.0.0.1", "evil.example", {**HTTPS, "x-forwarded-host": NAME}, "unknown_host"),
        ("", NAME, HTTPS, "plain_http"),
    ],
)
def test_other_ways_into_a_public_server_are_refused(
    peer: str, host: str, told: dict[str, str], code: str
) -> None:
    assert refusal(Entrance.of(PUBLIC), scope(peer, host, told)) == code


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1:8765", "[::1]:8765"])
def test_the_machine_itself_needs_no_proxy(host: str) -> None:
    one = scope("127.0.0.1", host, {})
    assert refusal(Entrance.of(PUBLIC), one) == ""
    assert (one["client"][0], one["scheme"]) == ("127.0.0.1", "http")


def test_a_server_for_this_machine_believes_nobody() -> None:
    told = {**HTTPS, "x-forwarded-host": NAME, "forwarded": "for=192.0.2.7;proto=https"}
    one = scope("127.0.0.1", "localhost", told)
    assert refusal(Entrance.of(Settings(hosts=NAME)), one) == ""
    assert (one["client"][0], one["scheme"]) == ("127.0.0.1", "http")
    assert refusal(Entrance.of(Settings(hosts=NAME)), scope("127.0.0.1", NAME, HTTPS)) == "unknown_host"


@pytest.mark.parametrize(
    "host",
    [
        "",
        " ",
        "localhost:",
        "localhost:x",
        "localhost:123456",
        "localhost:\u00b2",
        "localhost ",
        "localhost.",
        "user@localhost",
        "localhost/x",
        "localhost,evil.example",
        "[::1",
        "::1",
        "local\u00b5host",
        f"{NAME}:80:80",
        f"{NAME}@evil.example",
    ],
)
@pytest.mark.parametrize("settings", [Settings(), PUBLIC], ids=["local", "public"])
def test_a_malformed_host_is_refused(settings: Settings, host: str) -> None:
    told = HTTPS if settings.public else {}
    assert refusal(Entrance.of(settings), scope("127.0.0.1", host, told)) == "unknown_host"


@pytest.fixture
def public(db: Database, settings: Settings) -> httpx2.Client:
    """A client of the public server's proxy."""
    given = settings.model_copy(update={"public": True, "hosts": NAME})
    return TestClient(
        create_app(given, db),
        base_url=f"http://{NAME}",
        headers=HTTPS,
        client=("127.0.0.1", 50_000),
        raise_server_exceptions=False,
    )


def test_cookies_of_https_are_secure_and_those_of_this_machine_are_not(
    public: httpx2.Client, client: httpx2.Client
) -> None:
    for one, secure in ((public, True), (client, False)):
        cookie = one.post("/practice/done", follow_redirects=False).headers["set-cookie"]
        assert ("secure" in cookie.lower()) is secure
        assert "httponly" in cookie.lower()


def test_a_form_counts_as_ours_by_its_whole_origin(public: httpx2.Client) -> None:
    codes = [
        public.post("/practice/done", headers={"Origin": origin}, follow_redirects=False).status_code
        for origin in (f"https://{NAME}", f"http://{NAME}", "https://other.example", f"https://{NAME}:8443")
    ]
    assert codes == [303, 403, 403, 403]


def test_people_are_told_on_a_page_and_programs_in_json(public: httpx2.Client) -> None:
    plain = {"X-Forwarded-Proto": "http"}
    page = public.get("/", headers=plain)
    assert page.status_code == 403
    assert page.headers["content-type"].startswith("text/html")
    assert "This server takes https only." in page.text
    assert "default-src 'self'" in page.headers["content-security-policy"]
    assert public.get("/api/v1/runs", headers=plain).json()["error"]["code"] == "plain_http"

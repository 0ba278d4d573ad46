"""The checks before every route: hosts, cross-site requests, headers (E2, E3)."""

import httpx2
import pytest
from pydantic import ValidationError

from parenting.server.settings import Settings
from parenting.server.tables import Run

pytestmark = pytest.mark.only("sqlite", "such requests are refused before the store is asked")


@pytest.mark.parametrize(
    "host", ["localhost", "localhost:8765", "127.0.0.1:80", "[::1]", "[::1]:8765", "LOCALHOST"]
)
def test_known_hosts_pass(client: httpx2.Client, host: str) -> None:
    assert client.get("/healthz", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "localhost.evil.example", "127.0.0.1.evil.example:80", "::1", "x:localhost"]
)
def test_unknown_hosts_are_refused(client: httpx2.Client, host: str) -> None:
    refused = client.get("/healthz", headers={"Host": host})
    assert (refused.status_code, refused.json()["error"]["code"]) == (400, "unknown_host")


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Sec-Fetch-Site": "same-origin"},
        {"Sec-Fetch-Site": "none"},
        {"Origin": "http://localhost"},
        {"Sec-Fetch-Site": "same-origin", "Origin": "http://localhost"},
    ],
)
def test_own_pages_and_programs_may_act(client: httpx2.Client, run: Run, headers: dict[str, str]) -> None:
    assert client.post(f"/api/v1/runs/{run.id}/pause", headers=headers).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"Sec-Fetch-Site": ""},
        {"Sec-Fetch-Site": "cross-site", "Origin": "http://localhost"},
        {"Origin": "http://evil.example"},
        {"Origin": "http://localhost:9999"},
        {"Origin": "null"},
        {"Origin": ""},
    ],
)
def test_other_sites_may_not(client: httpx2.Client, run: Run, headers: dict[str, str]) -> None:
    for method in ("POST", "PUT", "DELETE", "PATCH"):
        refused = client.request(method, f"/api/v1/runs/{run.id}/pause", headers=headers)
        assert (refused.status_code, refused.json()["error"]["code"]) == (403, "cross_site")
    assert client.get(f"/api/v1/runs/{run.id}", headers=headers).json()["status"] == "active"


@pytest.mark.parametrize("path", ["/healthz", "/api/v1/nothing", "/static/vendor/plotly.min.js", "/"])
def test_headers_stand_on_every_reply(client: httpx2.Client, path: str) -> None:
    headers = client.get(path).headers
    policy = headers["content-security-policy"]
    assert "default-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "script-src" not in policy, "scripts fall under default-src: our own files, nothing inline"
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "same-origin"


@pytest.mark.parametrize("length", ["-1", "x", "9" * 30, "1e3"])
def test_odd_length_is_refused(client: httpx2.Client, length: str) -> None:
    assert client.get("/healthz", headers={"Content-Length": length}).status_code == 413


@pytest.mark.parametrize(
    "sources", ["http://a;script-src *", "http://a, *", "http://a\nX: b", "http://ä", " ", "a\t b"]
)
def test_only_sources_come_into_the_policy(sources: str) -> None:
    with pytest.raises(ValidationError, match="sources in printable ASCII"):
        Settings(frame_ancestors=sources)
    assert Settings(frame_ancestors="'self' http://localhost:*").frame_ancestors.endswith(":*")

"""nginx and Caddy before a public server, as docs/operations.md has them; skipped without these programs."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import httpx2
import pytest

from parenting.server.access import tokens
from parenting.server.access.roles import Role
from parenting.server.db import Database
from parenting.server.notify import Notifier
from parenting.server.queue.answers import get_query
from parenting.server.settings import Settings
from tests import proxies
from tests.access import opening
from tests.database import migrated
from tests.pages import island_fixtures as fixtures
from tests.pages.parent_page import form
from tests.server.processes import Command
from tests.server.serving import free_port, until_up

pytestmark = pytest.mark.slow
PARENT = "a-parent-at-a-browser"


@dataclass
class Web:
    """A web process on a port of its own."""

    settings: Settings
    db: Database

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.settings.port}"


@pytest.fixture(scope="module")
def web(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Web]:
    settings = Settings(data=tmp_path_factory.mktemp("data"), database_url=None, port=free_port())
    db = migrated(settings)
    environment = {"PARENTING_PORT": str(settings.port), "PARENTING_HOSTS": proxies.NAME}
    process = Command("web", "--public", data=settings.data, environment=environment)
    try:
        until_up(f"http://127.0.0.1:{settings.port}")
        yield Web(settings, db)
    finally:
        process.kill()
        db.close()


@pytest.fixture(scope="module", params=list(proxies.COMMANDS))
def client(
    request: pytest.FixtureRequest, web: Web, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[httpx2.Client]:
    """A program with the researcher's token, before the proxy."""
    folder: Path = tmp_path_factory.mktemp(request.param)
    token = tokens.make(web.db, "program", Role.RESEARCHER).secret
    with proxies.proxy(request.param, folder, web.settings.port, token) as found:
        yield found


def browser(client: httpx2.Client, site: str = "same-origin") -> dict[str, str]:
    """The headers of a present browser on a page of this host."""
    return {"Origin": f"https://{client.headers['host']}", "Sec-Fetch-Site": site}


@pytest.mark.parametrize("path", ["/", "/api/v1/runs", "/metrics"])
def test_nothing_is_shown_to_strangers(client: httpx2.Client, path: str) -> None:
    assert client.get(path).status_code == 200
    for wrong in ("Bearer guessed", "Basic cGFyZW50Omd1ZXNzZWQ=", ""):
        assert client.get(path, headers={"Authorization": wrong}).status_code == 401
    for open_to_anyone in ("/healthz", "/static/live.js"):
        assert client.get(open_to_anyone, headers={"Authorization": ""}).status_code == 200


def test_a_run_is_started_and_a_question_answered_by_the_forms_of_a_browser(
    client: httpx2.Client, web: Web
) -> None:
    token = client.headers.pop("Authorization")
    entered = client.post("/open", data={"token": opening(web.db)}, headers=browser(client))
    assert entered.status_code == 303, entered.text
    assert "; Secure" in entered.headers["set-cookie"]
    started = client.post("/runs", data={"world": "unsafe-exploration"}, headers=browser(client))
    assert started.status_code == 303, started.text
    assert client.get(started.headers["location"], headers=browser(client)).status_code == 200

    run, claim = fixtures.start_run(web.db)
    query = fixtures.ask(web.db, claim, 1, "guidance", fixtures.guidance("left", "down"))
    page = client.get(f"/runs/{run.id}/parent", follow_redirects=True)
    assert page.status_code == 200
    assert page.headers["strict-transport-security"] == "max-age=31536000"
    assert "; Secure" in page.headers["set-cookie"]
    answered = client.post(
        f"/runs/{run.public_id}/parent/answer",
        data=form(web.db, query, choice="left", client_id=PARENT),
        headers=browser(client),
    )
    assert answered.status_code == 303, answered.text
    assert answered.headers["location"].startswith(f"/runs/{run.public_id}/parent")
    assert get_query(web.db, query).status == "answered"
    client.cookies.clear()
    client.headers["Authorization"] = token


def test_forms_of_other_sites_are_refused_whatever_the_browser_names(client: httpx2.Client) -> None:
    own = browser(client)["Origin"]
    plain, elsewhere = own.replace("https", "http"), "https://evil.example"
    for headers in (
        {"Origin": elsewhere, "Sec-Fetch-Site": "cross-site"},
        {"Origin": elsewhere},
        {"Origin": plain},
    ):
        assert client.post("/runs", data={"world": "unsafe-exploration"}, headers=headers).status_code == 403
    older = {"Origin": own}  # a browser of before 2023 does not send Sec-Fetch-Site
    assert client.post("/runs", data={"world": "unsafe-exploration"}, headers=older).status_code == 303


def test_the_secret_of_a_link_is_in_no_log(
    client: httpx2.Client, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> None:
    assert client.get("/open", params={"token": "pl_a-secret"}).status_code == 410
    folder = f"{request.node.callspec.params['client']}0"
    files = [tmp_path_factory.getbasetemp() / folder / name for name in ("log", "said")]
    end = time.monotonic() + 10
    while "/open" not in (told := "".join(one.read_text() for one in files if one.exists())):
        assert time.monotonic() < end, told
        time.sleep(0.02)
    assert "pl_a-secret" not in told


def test_requests_under_another_name_are_refused(client: httpx2.Client) -> None:
    for name in ("evil.example", "localhost", "127.0.0.1"):
        assert client.get("/", headers={"Host": name}).status_code == 421


def test_an_address_that_moved_stays_at_this_host(client: httpx2.Client, web: Web) -> None:
    run, _ = fixtures.start_run(web.db)
    moved = client.get(f"/runs/{run.id}/")
    assert moved.status_code == 307
    assert httpx2.URL(moved.headers["location"]).host in ("", proxies.NAME)


def test_large_heads_and_bodies_are_refused(client: httpx2.Client) -> None:
    def send(size: int, chunked: bool) -> int:
        body = b"a" * size
        headers = {"Content-Type": "application/json"}
        content = iter([body]) if chunked else body
        return client.post("/api/v1/runs", content=content, headers=headers).status_code

    assert [send(64 * 1024, chunked) for chunked in (False, True)] == [422, 422]
    assert [send(64 * 1024 + 1, chunked) for chunked in (False, True)] == [413, 413]
    assert client.get("/healthz", headers={"X-Long": "a" * 4_000}).status_code == 200
    assert client.get("/healthz", headers={"X-Long": "a" * 20_000}).status_code in (400, 431)


def test_a_live_stream_arrives_as_it_happens_and_ends_with_its_reader(
    client: httpx2.Client, web: Web
) -> None:
    run, claim = fixtures.start_run(web.db)
    with client.stream("GET", f"/api/v1/runs/{run.id}/events") as reply:
        lines = (line for line in reply.iter_lines() if line.startswith("data: "))
        assert next(lines) == "data: null", "no question is open"
        fixtures.ask(web.db, claim, 1, "guidance", fixtures.guidance("left", "down"))
        Notifier(web.settings.data, "web").notify()
        assert any('"kind": "guidance"' in line for line in lines), "it came while the stream goes on"
        assert streams(web) == 1
    until(web, 0)


@pytest.mark.parametrize("client", ["nginx"], indirect=True)
def test_nginx_gives_one_address_forty_requests_at_once(client: httpx2.Client, web: Web) -> None:
    run, _ = fixtures.start_run(web.db)
    client.cookies.clear()  # a browser has fewer streams; programs have no cookie
    with ExitStack() as stack:
        for _ in range(40):
            reply = stack.enter_context(client.stream("GET", f"/api/v1/runs/{run.id}/events"))
            assert reply.status_code == 200
        assert client.get("/healthz").status_code == 429
    until(web, 0)
    assert client.get("/healthz").status_code == 200


def test_what_a_client_says_of_itself_does_not_pass_the_proxy(client: httpx2.Client, web: Web) -> None:
    told = {"X-Forwarded-Proto": "http", "X-Forwarded-For": "nobody", "X-Forwarded-Host": "evil.example"}
    run, _ = fixtures.start_run(web.db)
    moved = client.get(f"/runs/{run.id}/", headers=told)
    assert moved.headers["location"] == f"https://{client.headers['host']}/runs/{run.id}"


@pytest.mark.parametrize("name", [proxies.NAME, "127.0.0.1"])
@pytest.mark.parametrize("told", [{}, {"X-Forwarded-Proto": "http", "X-Forwarded-For": "192.0.2.1"}])
def test_beside_the_proxy_plain_http_is_for_this_machine_alone(
    web: Web, name: str, told: dict[str, str]
) -> None:
    reply = httpx2.get(f"{web.url}/api/v1/runs", headers={"Host": name, **told})
    if name == "127.0.0.1" and not told:
        assert reply.status_code == 200
    else:
        assert (reply.status_code, reply.json()["error"]["code"]) == (403, "plain_http")


def streams(web: Web) -> int:
    """The number of live streams that the web process has open."""
    (line,) = [
        line
        for line in httpx2.get(f"{web.url}/metrics").text.splitlines()
        if line.startswith("parenting_streams_open ")
    ]
    return int(float(line.split()[1]))


def until(web: Web, number: int) -> None:
    """Wait until so many live streams are open."""
    end = time.monotonic() + 30
    while streams(web) != number:
        assert time.monotonic() < end, f"{streams(web)} streams are open"
        time.sleep(0.05)

"""docs/api.md cannot rot: every route, code and key has its line, and its commands are run here."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import httpx2
import pytest

from parenting.server import errors
from parenting.server.api.examples import EXPORTED
from parenting.server.app import bare_app
from parenting.server.db import Database
from parenting.server.errors import ServerError
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import claim
from tests.server.conftest import CLIPS
from tests.tree import ROOT

pytestmark = pytest.mark.only("sqlite", "the page of the API says nothing of the store")

TEXT = (ROOT / "docs/api.md").read_text(encoding="utf-8")
ROWS = [line for line in TEXT.splitlines() if line.startswith("| ")]
EARLY = {(431, "too_large")}
"""Refused before the application sees it, by `server.connections`."""
OURS = {"setup", "lost_claim"}
"""Codes that no request meets: commands print one, and workers alone raise the other."""


@dataclass(frozen=True)
class Command:
    """A request, as curl's arguments say it."""

    method: str
    path: str
    body: str | None
    live: bool


def commands() -> Iterator[Command]:
    """Those of all blocks, in their order."""
    for block in re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL):
        for line in block.replace("\\\n", "").splitlines():
            if not line.startswith(("export PARENTING_TOKEN=", "api=", "curl() ")):
                yield _read(shlex.split(line.replace("$api", "/api/v1")))


def _read(words: list[str]) -> Command:
    assert words.pop(0) == "curl"
    method, path, body, live = "GET", "", None, False
    rest = iter(words)
    for word in rest:
        if word == "--data":
            method, body = "POST", next(rest)
        elif word == "--header":
            assert next(rest) == "Content-Type: application/json"
        elif word == "-X":
            method = next(rest)
        elif word == "-o":
            next(rest)
        elif word.startswith("-"):
            assert word in ("-s", "-sN")
            live = "N" in word
        else:
            path = word
    return Command(method, path, body, live)


def names(text: str) -> set[str]:
    return set(re.findall(r"`([^`]+)`", text))


def test_every_route_has_its_line() -> None:
    paths = bare_app().openapi()["paths"].items()
    routes = [f"{method.upper()} {path}" for path, methods in paths for method in methods]
    assert len(routes) > 20
    assert [route for route in routes if not any(row.startswith(f"| `{route}` |") for row in ROWS)] == []
    told = [row.split("`")[1] for row in ROWS if re.match(r"\| `(GET|POST) ", row)]
    assert sorted(told) == sorted(routes), "and no line is left of a route that is gone"


def test_every_error_has_its_line() -> None:
    kinds = [
        kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, ServerError)
    ]
    told = {
        (int(row.split(" | ")[0].strip("| ")), code)
        for row in ROWS
        if re.match(r"\| [45]\d\d \|", row)
        for code in names(row.split(" | ")[1])
    }
    assert told - EARLY == {(kind.status, kind.code) for kind in kinds if kind.code not in OURS}


def test_every_key_of_the_export_has_its_line() -> None:
    table = TEXT.partition("| key | what it is |")[2].partition("\n\n")[0]
    firsts = {name for row in table.splitlines()[2:] for name in names(row.split(" | ")[0])}
    assert firsts == EXPORTED.keys()


def test_its_commands_do_what_they_say(client: httpx2.Client, db: Database) -> None:
    """In their order, on an empty database, as they stand there. The agent asks twice, after its start."""
    said: list[Any] = []
    for command in commands():
        if command.live:
            client.app.state.streams.close()  # type: ignore[attr-defined]  # else it would stream without end
        headers = {"Content-Type": "application/json"} if command.body else {}
        reply = client.request(command.method, command.path, content=command.body, headers=headers)
        assert 200 <= reply.status_code < 300, (command, reply.text)
        said.append((command.path.rpartition("/")[2], reply))
        if len(said) == 1:
            agent = claim(db, "worker-1")[0]
            post_query(db, agent, 1, "guidance", 1, CLIPS)
            post_query(db, agent, 2, "preference", 1, CLIPS)
    assert [status.status_code for name, status in said if name == "lease"] == [200]
    assert len(said) == 27


def test_an_error_looks_as_it_says(client: httpx2.Client) -> None:
    (shown,) = re.findall(r"```json\n(.*?)```", TEXT, re.DOTALL)
    reply = client.post("/api/v1/runs", json={"world": "unsafe-exploration", "seed": "one"})
    assert reply.json() == json.loads(shown)

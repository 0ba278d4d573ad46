"""The first request is as quick as any: what it would wait for is done before the server listens."""

from __future__ import annotations

import fastapi.routing
import pytest
from fastapi.testclient import TestClient
from jinja2 import Environment

from parenting.server import app
from parenting.server.db import Database
from parenting.server.pages import render
from parenting.server.settings import Settings
from parenting.server.tables import Run

PAGES = ("/", "/runs/1", "/runs/1/parent")


@pytest.mark.slow
def test_no_request_waits_for_a_template_or_for_what_a_route_needs(
    settings: Settings, db: Database, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    app._routes.cache_clear()  # as in a process that has just started
    assert render._templates.cache is not None
    render._templates.cache.clear()
    render.compile_first.cache_clear()
    late: list[str] = []
    with TestClient(app.create_app(settings, db), base_url="http://localhost") as client:
        for place, name in ((fastapi.routing, "get_dependant"), (Environment, "compile")):
            monkeypatch.setattr(place, name, lambda *_, name=name, **__: late.append(name))
        for path in PAGES:
            assert client.get(path).status_code == 200
    assert late == []

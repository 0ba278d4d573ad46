"""The page of a refusal leads back to what was refused."""

from __future__ import annotations

from typing import NoReturn

import httpx2
import pytest

from parenting.server.db import Database
from parenting.server.errors import BusyError, DiskFullError, StoreError
from tests.pages import island_fixtures as fixtures


@pytest.mark.parametrize(("kind", "status"), [(BusyError, 503), (DiskFullError, 507)])
def test_what_the_store_refused_may_be_tried_again(
    client: httpx2.Client, db: Database, monkeypatch: pytest.MonkeyPatch, kind: type[StoreError], status: int
) -> None:
    fixtures.start_run(db)

    def refuse(*_: object, **__: object) -> NoReturn:
        raise kind

    for verb in ("read", "write"):
        monkeypatch.setattr(db, verb, refuse)
    looked = client.get("/runs/1/history?choice=left")
    assert looked.status_code == status
    assert '<a class="button" href="/runs/1/history?choice=left">Try again</a>' in looked.text
    sent = client.post("/runs/1/status", data={"status": "paused"})
    assert sent.status_code == status
    assert '<a class="button" href="/runs/1">Go on</a>' in sent.text

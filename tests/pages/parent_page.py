"""The parent's page, whose address and forms carry public ids, from the numbers that tests know."""

from __future__ import annotations

from typing import Any

import httpx2
from playwright.sync_api import Page, expect
from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.identity import database_id
from parenting.server.runs import get_run
from parenting.server.tables import Query


def look(client: httpx2.Client, query: int | None = None, run: int = 1) -> httpx2.Response:
    """The page, by way of the address that a researcher writes."""
    moved = client.get(
        f"/runs/{run}/parent" + ("" if query is None else f"?query={query}"), follow_redirects=False
    )
    assert moved.status_code == 307, moved.text
    return client.get(moved.headers["location"])


def address(db: Database, run: int = 1, query: int | None = None) -> str:
    """The address of the page, as a parent has it."""
    path = f"/runs/{get_run(db, run).public_id}/parent"
    return path if query is None else f"{path}?query={public_id(db, query)}"


def public_id(db: Database, query: int) -> str:
    """The public id of a question."""
    with db.read() as session:
        return session.execute(select(Query.public_id).where(Query.id == query)).scalar_one()


def form(db: Database, query: int, **fields: str) -> dict[str, Any]:
    """The fields that the form of a question sends."""
    return {"database": database_id(db), "question": public_id(db, query), **fields}


def named(page: Page, query: int) -> str:
    """The public id of a question, as the API tells it."""
    origin = page.url.partition("/runs/")[0].rstrip("/")
    name: str = page.request.get(f"{origin}/api/v1/queries/{query}").json()["public_id"]
    return name


def shown(page: Page, query: int) -> None:
    """Wait until a question is on the page and takes an answer."""
    expect(page.locator(f'#question[data-query="{named(page, query)}"][data-listening]')).to_be_visible()

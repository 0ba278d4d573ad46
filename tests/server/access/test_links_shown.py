"""A page shows its reader no link and no form that would be refused, whoever they are."""

from __future__ import annotations

from html.parser import HTMLParser
from typing import Any

import httpx2
import pytest
from starlette.routing import compile_path

from parenting.server.access import tokens
from parenting.server.access.matrix import ROWS, Rule
from parenting.server.access.roles import Role
from parenting.server.db import Database
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim, get_run, set_status
from parenting.server.statuses import RunStatus
from tests.server.conftest import CLIPS

pytestmark = pytest.mark.only("sqlite", "what a page shows does not depend on the store")

PAGES = {
    Role.RESEARCHER: (
        "/",
        "{run}",
        "{run}/parent",
        "{run}/history",
        "{run}/settings",
        "{run}/end",
        "/compare",
    ),
    Role.VIEWER: ("/", "{run}", "/compare"),
    Role.PARENT: ("{run}/parent", "{run}/history", "/practice?run={id}"),
}
ANYWHERE = ("/practice", "/help")
PLACES = [(role, page, role is Role.PARENT) for role, pages in PAGES.items() for page in (*pages, *ANYWHERE)]
PLACES += [(Role.VIEWER, page, True) for page in ("{run}", "/practice")]  # a viewer of one run


class Targets(HTMLParser):
    """Collects what a page leads to: methods and paths."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.method, self.found = "GET", set[tuple[str, str]]()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        if tag == "form":
            self.method = (named.get("method") or "get").upper()
        for name, method in (("href", "GET"), ("action", self.method), ("formaction", self.method)):
            if tag in ("a", "form", "button") and (path := named.get(name) or "").startswith("/"):
                self.found.add((method, path.partition("?")[0].partition("#")[0]))


def rule_of(method: str, path: str) -> Rule:
    """The row of an address in the matrix."""
    found = [
        rule
        for (named, template), rule in ROWS.items()
        if named == method and compile_path(template)[0].fullmatch(path)
    ]
    assert found, f"no route for {method} {path}"
    return found[0]


def is_refused(rule: Rule, role: Role, confined: bool) -> bool:
    """Return whether somebody may not use an address."""
    if rule.roles is None:
        return False
    return role not in rule.roles or (confined and rule.where == "everything")


@pytest.mark.slow_after(5)
@pytest.mark.parametrize("status", [RunStatus.ACTIVE, RunStatus.PAUSED, RunStatus.STOPPED])
@pytest.mark.parametrize(("role", "page", "confined"), PLACES)
def test_no_page_offers_what_is_refused(
    client: httpx2.Client, db: Database, mine: Claim, role: Role, page: str, confined: bool, status: RunStatus
) -> None:
    answer(db, post_query(db, mine, 1, "guidance", 1, CLIPS), "left", "a", "human")
    run = get_run(db, mine.run_id)
    if status is not RunStatus.ACTIVE:
        set_status(db, run.id, status)
    scope: dict[str, Any] = {"run": run.id} if confined else {}
    scope |= {"client_id": "a"} if role is Role.PARENT else {}
    client.headers["Authorization"] = f"Bearer {tokens.make(db, 'program', role, **scope).secret}"
    shown = client.get(page.format(run=f"/runs/{run.public_id}", id=run.public_id))
    assert shown.status_code == 200, shown.text
    found = Targets(shown.text).found
    assert found or page == "/help", "a part of a page"
    assert {target for target in found if is_refused(rule_of(*target), role, confined)} == set()

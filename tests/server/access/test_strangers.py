"""Every row of the access matrix, tried by a stranger, viewers, parents and the researcher."""

from __future__ import annotations

from typing import NoReturn

import httpx2
import pytest
from fastapi import Request

from parenting.server.access import guard
from parenting.server.access.guard import admit
from parenting.server.access.matrix import ROWS, Rule
from parenting.server.access.roles import Role
from parenting.server.errors import ServerError
from parenting.server.public_ids import public_id
from tests.server.access.house import House, send

pytestmark = pytest.mark.only("sqlite", "whoever is refused is refused before the store is asked")

IN = "let in"
ENGINE = ("static", "healthz", "readyz", "openapi.json")
"""Routes that answer by themselves; none of them could be held."""


class LetIn(ServerError):
    """The guard let this request in."""

    status, code = 418, IN


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every request that is let in is held behind the guard, so that it does nothing."""

    async def hold(request: Request) -> NoReturn:
        await admit(request)
        raise LetIn

    monkeypatch.setattr(guard, "admit", hold)


def filled(path: str, house: House) -> str:
    names = {
        "run_id": house.run.public_id,
        "query_id": house.question,
        "job_id": house.job,
        "pseudonym": "p22222222a",
        "access_id": public_id(),
        "tick": "5",
        "rest": "0",
    }
    return path.format(**names)


def expected(rule: Rule, who: str) -> int:
    """The status that is due, by the table and by what each of them is confined to."""
    if rule.roles is None:
        return 418
    if who == "stranger":
        return 401
    role = Role(who.split()[-1] if who == "second parent" else who.split()[0])
    if role not in rule.roles:
        return 403
    if who in ("researcher", "viewer") or rule.where == "nothing":
        return 418
    elsewhere = rule.where == "everything" or (rule.where in ("run", "question", "job") and "another" in who)
    not_theirs = who == "second parent" and rule.where in ("question", "job")
    return 403 if elsewhere or not_theirs else 418


def test_every_row_of_the_matrix_holds_for_everybody(
    stranger: httpx2.Client, house: House, held: None
) -> None:
    wrong, seen = [], set()
    for (method, path), rule in ROWS.items():
        if rule.roles is None and any(name in path for name in ENGINE):
            continue
        for who, bearer in house.bearers.items():
            status = send(stranger, method, filled(path, house), bearer).status_code
            seen.add((who, status))
            if status != expected(rule, who):
                wrong.append((method, path, who, status, expected(rule, who)))
    assert wrong == []
    bound = [who for who in house.bearers if who not in ("stranger", "researcher")]
    assert {(who, status) for who in bound for status in (403, 418)} <= seen
    assert {("stranger", 401), ("researcher", 418)} <= seen
    assert ("researcher", 403) not in seen

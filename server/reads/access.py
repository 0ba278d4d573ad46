"""The lists of the page of links and tokens: all that lets somebody in. Of secrets only hashes are stored."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import select

from parenting.server.access.roles import Role
from parenting.server.access.sessions import list_sessions
from parenting.server.access.tables import AccessSession, AccessToken
from parenting.server.access.tokens import list_tokens
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.persons import pseudonyms
from parenting.server.tables import Run

MOST = 200
"""Rows of one list at most, the newest; `parenting access list` prints all of them."""
AT_ONCE = 500
"""Runs that one statement looks up."""


@dataclass(frozen=True)
class Listed:
    """A token, a link or a session. What cannot be read is None."""

    id: str
    role: str | None
    name: str | None
    run: int | None
    run_public_id: str | None  # None where the run is gone, too
    person: str | None  # the pseudonym of the parent, once they have answered
    made_by: str | None
    created: datetime | None
    last_used: datetime | None
    expires: datetime | None
    seated: bool  # a browser has come in by this link


@dataclass(frozen=True)
class Group:
    """One list, the newest first, and how many more there are."""

    rows: list[Listed]
    more: int


@dataclass(frozen=True)
class Listing:
    """The lists of the page."""

    parents: Group
    viewers: Group
    programs: Group
    openings: Group
    sessions: Group


def listing(db: Database, idle: timedelta) -> Listing:
    """Return what opens this house now.

    Args:
        db: The database.
        idle: The time without use after which a session has ended.
    """
    began = db.clock() - idle
    sessions = [one for one in list_sessions(db) if (sound(one, "last_used") or began) > began]
    tokens = list_tokens(db)
    groups: dict[str, list[AccessToken | AccessSession]] = {"sessions": [*sessions]}
    for token in tokens:
        groups.setdefault(_group(token), []).append(token)
    shown = [row for rows in groups.values() for row in rows[:MOST]]
    runs, people = _runs(db, shown), _people(db, shown)
    taken = {sound(one, "token_id") for one in sessions}

    def listed(row: AccessToken | AccessSession) -> Listed:
        seated = isinstance(row, AccessToken) and row.id in taken
        run = sound(row, "run_id")
        return Listed(
            id=sound(row, "public_id") or "",
            role=sound(row, "role"),
            name=sound(row, "name"),
            run=run,
            run_public_id=runs.get(run),
            person=people.get(sound(row, "client_id") or ""),
            made_by=sound(row, "made_by") if isinstance(row, AccessToken) else None,
            created=sound(row, "created"),
            last_used=sound(row, "last_used"),
            expires=sound(row, "expires"),
            seated=seated,
        )

    def group(name: str) -> Group:
        rows = groups.get(name, [])
        return Group([listed(row) for row in rows[:MOST]], max(0, len(rows) - MOST))

    return Listing(*(group(name) for name in ("parents", "viewers", "programs", "openings", "sessions")))


def _group(token: AccessToken) -> str:
    kind = sound(token, "kind")
    if kind == "link":
        return "parents" if sound(token, "role") == Role.PARENT else "viewers"
    return "openings" if kind == "opening" else "programs"


def _runs(db: Database, rows: Iterable[AccessToken | AccessSession]) -> dict[int | None, str]:
    """Return the public ids of the runs that rows name, by their numbers."""
    numbers = sorted({sound(row, "run_id") for row in rows} - {None})
    found: dict[int | None, str] = {}
    for part in _parts(numbers):
        asked = select(Run.id, Run.public_id).where(Run.id.in_(part), Run.deleting.is_(None))
        with db.read() as session:
            found.update({row.id: row.public_id for row in session.execute(asked)})
    return found


def _people(db: Database, rows: Iterable[AccessToken | AccessSession]) -> dict[str, str]:
    return pseudonyms(db, {sound(row, "client_id") for row in rows} - {None})


def _parts(numbers: Sequence[int]) -> Iterable[Sequence[int]]:
    return (numbers[first : first + AT_ONCE] for first in range(0, len(numbers), AT_ONCE))

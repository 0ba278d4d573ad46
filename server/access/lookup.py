"""Find the session or the token of a secret in the database."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import Row, select, update
from sqlalchemy.orm import Session

from parenting.server.access.roles import Principal, Role, Way
from parenting.server.access.tables import AccessSession, AccessToken
from parenting.server.damage import damage
from parenting.server.tables import Identity, Run

TABLES: dict[Way, type[AccessSession] | type[AccessToken]] = {"session": AccessSession, "token": AccessToken}


@dataclass
class Known:
    """A principal that was found, and until when it counts."""

    principal: Principal
    row: int  # the number of its session or token
    expires: datetime
    idle: timedelta | None  # a session ends after so long without use; a token does not
    stored: datetime | None  # its last use as the database has it
    seen: datetime  # its last use here

    def is_over(self, now: datetime) -> bool:
        """Return whether it has expired, or was idle for too long."""
        return now >= self.expires or (self.idle is not None and now - self.seen >= self.idle)


def find(session: Session, way: Way, hashed: str, now: datetime, idle: timedelta) -> Known | None:
    """Return whose the secret with this hash is; None if it opens nothing, or nothing any more."""
    if way == "session":
        return _session(session, hashed, now, idle)
    rows = select(AccessToken, Run.public_id).outerjoin(Run, Run.id == AccessToken.run_id)
    found = session.execute(
        rows.where(AccessToken.digest == hashed, AccessToken.kind == "program", AccessToken.revoked.is_(None))
    ).first()
    return None if found is None else _known(found, "token", found[0].last_used, now, None)


def _session(session: Session, hashed: str, now: datetime, idle: timedelta) -> Known | None:
    rows = select(AccessSession, Run.public_id).outerjoin(Run, Run.id == AccessSession.run_id)
    found = session.execute(
        rows.where(AccessSession.digest == hashed, AccessSession.revoked.is_(None))
    ).first()
    return None if found is None else _known(found, "session", found[0].last_used, now, idle)


def _known(
    found: Row[AccessSession, str] | Row[AccessToken, str],
    way: Way,
    used: datetime | None,
    now: datetime,
    idle: timedelta | None,
) -> Known | None:
    row, run = found
    if damage(row) is not None:
        return None  # what cannot be read opens nothing
    who = Principal(Role(row.role), way, row.public_id, row.name, row.run_id, run, row.client_id)
    known = Known(who, row.id, row.expires, idle, used, used or now)
    return None if known.is_over(now) else known


def revision(session: Session) -> int:
    """Return the number that grows with each revocation."""
    return session.execute(select(Identity.access_revision)).scalar_one()


def keep_uses(session: Session, used: Iterable[Known]) -> None:
    """Store when sessions and tokens were used last."""
    for one in used:
        table = TABLES[one.principal.way]
        session.execute(update(table).where(table.id == one.row).values(last_used=one.seen))

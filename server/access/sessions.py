"""Sessions of browsers, kept on the server: a cookie holds a secret, and the database its hash."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

from sqlalchemy import ColumnElement, Select, select, update
from sqlalchemy.orm import Session

from parenting.server.access.lookup import find
from parenting.server.access.roles import Principal, Role
from parenting.server.access.secret import digest, draw, kind_of
from parenting.server.access.tables import AccessSession, AccessToken
from parenting.server.access.tokens import tell_revoked
from parenting.server.audit.recording import record
from parenting.server.audit.table import Kind
from parenting.server.db import Database
from parenting.server.errors import UsedUpError

HOW = {"opening": "address", "link": "link"}
"""The audit log's name for that by which somebody enters."""
DAYS, IDLE_DAYS = 30.0, 7.0
"""Days after which a session ends: since it began, and since it was used."""


class Entered(NamedTuple):
    """A session that has just begun, with the secret for its cookie."""

    session: AccessSession
    secret: str


def enter(db: Database, secret: str, former: str | None = None, *, days: float = DAYS) -> Entered:
    """Begin a session by an opening token, which is used up by it, or by a parent's link.

    A link has one seat: the session that was entered by it before ends, and so does the browser's `former`
    one. The secret of the new session is drawn here, so none that was planted in a browser becomes valid.

    Args:
        db: The database.
        secret: The secret of the token.
        former: The secret that the browser's cookie has, if any.
        days: Days after which the session ends, whatever is done with it.

    Raises:
        UsedUpError: no such token, or it was used up, has expired or was revoked.
    """
    if kind_of(secret) not in ("opening", "link"):
        raise UsedUpError
    now, drawn = db.clock(), draw("session")
    with db.write() as session:
        token = _take(session, digest(secret), now)
        _end(session, AccessSession.digest == digest(former or ""), now)
        if token.kind == "link":
            _end(session, AccessSession.token_id == token.id, now)
        expires = now + timedelta(days=days)
        begun = AccessSession(
            digest=digest(drawn),
            token_id=token.id,
            role=token.role,
            run_id=token.run_id,
            name=token.name,
            client_id=token.client_id,
            created=now,
            last_used=now,
            expires=min(expires, token.expires) if token.kind == "link" else expires,
        )
        session.add(begun)
        session.flush()
        way, who = (
            f"by {HOW[token.kind]} {token.public_id[:8]}",
            f"{token.role} by session {begun.public_id[:8]}",
        )
        record(db, session, Kind.LOGIN, way, who=who)
        tell_revoked(session)
    return Entered(begun, drawn)


def require_valid(db: Database, secret: str) -> AccessToken:
    """Return the token that a browser could enter by. Nothing is used up by looking.

    Raises:
        UsedUpError: as `enter`.
    """
    if kind_of(secret) not in ("opening", "link"):
        raise UsedUpError
    with db.read() as session:
        found = session.scalar(_valid(digest(secret), db.clock()))
    if found is None:
        raise UsedUpError
    return found


def same_as(db: Database, secret: str, cookie: str, idle: timedelta) -> Principal | None:
    """Return who a browser is already, if a token would make it that, or would have when it was valid.

    Whoever presses twice on an address has come in by the first press. Nothing begins and nothing ends here.

    Args:
        db: The database.
        secret: The secret of the token.
        cookie: The secret of the browser's session.
        idle: The time without use after which a session ends.
    """
    with db.read() as session:
        known = find(session, "session", digest(cookie), db.clock(), idle)
        rows = select(AccessToken.role, AccessToken.run_id).where(
            AccessToken.digest == digest(secret), AccessToken.kind.in_(HOW)
        )
        token = session.execute(rows).first()
    if known is None or token is None or (known.principal.role, known.principal.run) != tuple(token):
        return None
    return known.principal


def list_sessions(db: Database, all_of_them: bool = False) -> Sequence[AccessSession]:
    """Return the sessions that have not ended, or all that there were, the newest first."""
    rows = select(AccessSession).order_by(AccessSession.id.desc())
    if not all_of_them:
        rows = rows.where(AccessSession.revoked.is_(None), AccessSession.expires > db.clock())
    with db.read() as session:
        return session.scalars(rows).all()


def end(db: Database, secret: str) -> None:
    """End the session of a cookie's secret; one that has ended stays so."""
    with db.write() as session:
        record(db, session, Kind.LOGOUT, "left")
        _end(session, AccessSession.digest == digest(secret), db.clock())
        tell_revoked(session)


def end_all(db: Database, role: Role | None = None) -> None:
    """End all sessions, or those of a role."""
    with db.write() as session:
        _end(session, AccessSession.role == str(role) if role else AccessSession.id > 0, db.clock())
        record(db, session, Kind.REVOCATION, f"all sessions of {role}s" if role else "all sessions")
        tell_revoked(session)


def _take(session: Session, hashed: str, now: datetime) -> AccessToken:
    """Return a token that is valid; where several requests bring the same opening token, only the first."""
    token = session.scalar(_valid(hashed, now))
    if token is None:
        raise UsedUpError
    once = {"used": now} if token.kind == "opening" else {}
    taken = session.execute(
        update(AccessToken)
        .where(AccessToken.id == token.id, AccessToken.used.is_(None), AccessToken.revoked.is_(None))
        .values(last_used=now, **once)
        .returning(AccessToken.id)
    )
    if taken.scalar() is None:
        raise UsedUpError
    return token


def _valid(hashed: str, now: datetime) -> Select[AccessToken]:
    return select(AccessToken).where(
        AccessToken.digest == hashed,
        AccessToken.kind.in_(("opening", "link")),
        AccessToken.used.is_(None),
        AccessToken.revoked.is_(None),
        AccessToken.expires > now,
    )


def _end(session: Session, which: ColumnElement[bool], now: datetime) -> None:
    session.execute(update(AccessSession).where(which, AccessSession.revoked.is_(None)).values(revoked=now))

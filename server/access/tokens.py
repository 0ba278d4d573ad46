"""Tokens: make them, list them, revoke them. The secret is shown once, when the token is made."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta
from typing import Literal, NamedTuple

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from parenting.server.access.roles import Role
from parenting.server.access.secret import digest, draw
from parenting.server.access.tables import AccessSession, AccessToken
from parenting.server.audit.recording import record
from parenting.server.audit.table import Kind
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError, NotFound
from parenting.server.public_ids import public_id
from parenting.server.runs import find
from parenting.server.tables import Identity

TokenKind = Literal["opening", "program", "link"]

DAYS: dict[TokenKind, float] = {"opening": 1.0, "program": 90.0, "link": 30.0}
"""Days for which a token is valid, unless its maker says otherwise."""
MOST_DAYS = 3660.0
NAMES: dict[TokenKind, str] = {"opening": "address", "program": "token", "link": "link"}
"""The audit log's name for each kind."""
COMMAND = "a command"
"""The maker of a token that was made at a terminal."""


class Made(NamedTuple):
    """A token that was made, with the secret that nobody can read again."""

    token: AccessToken
    secret: str


def make(
    db: Database,
    kind: TokenKind,
    role: Role,
    *,
    run: int | None = None,
    name: str | None = None,
    days: float | None = None,
    client_id: str | None = None,
    made_by: str = COMMAND,
) -> Made:
    """Make a token.

    Args:
        db: The database.
        kind: opening (enters a browser once), program (a header), or link (the address for a parent).
        role: What it may do.
        run: The number of the only run that it opens; None: all. A parent's token opens one.
        name: What the researcher calls it.
        days: For how long it is valid; None: as `DAYS` says.
        client_id: The name under which a parent answers; None draws one.
        made_by: Whoever makes it, for the list.

    Raises:
        InvalidFieldsError: a parent's token names no run, or the days are none.
        NotFound: there is no such run.
    """
    lasts = DAYS[kind] if days is None else days
    if not 0 < lasts <= MOST_DAYS:
        raise InvalidFieldsError([("days", f"Write a number above 0 and up to {MOST_DAYS:g}.")])
    if role is Role.PARENT and run is None:
        raise InvalidFieldsError([("run", "Name the run that the parent answers.")])
    if role is Role.PARENT and client_id is None:
        client_id = f"p-{public_id()}"
    secret, now = draw(kind), db.clock()
    with db.write() as session:
        opened = None if run is None else find(session, run)
        token = AccessToken(
            kind=kind,
            digest=digest(secret),
            role=str(role),
            run_id=run,
            name=name,
            client_id=client_id,
            made_by=made_by,
            created=now,
            expires=now + timedelta(days=lasts),
        )
        session.add(token)
        session.flush()
        record(db, session, Kind.TOKEN, f"{NAMES[kind]} {token.public_id[:8]} for a {role}", opened)
    return Made(token, secret)


def require_run(db: Database, run: int) -> None:
    """Ask for a run that a token may open.

    Raises:
        NotFound: there is none of this number, or it is being deleted.
    """
    with db.read() as session:
        find(session, run)


def list_tokens(db: Database, all_of_them: bool = False) -> Sequence[AccessToken]:
    """Return the tokens that are valid, or all that there were, the newest first."""
    rows = select(AccessToken).order_by(AccessToken.id.desc())
    if not all_of_them:
        rows = rows.where(
            AccessToken.revoked.is_(None), AccessToken.used.is_(None), AccessToken.expires > db.clock()
        )
    with db.read() as session:
        return session.scalars(rows).all()


def revoke(db: Database, name: str) -> None:
    """Revoke a token and the sessions that were entered by it, or one session, by its public id.

    Other web processes see it within a second; in this one call `Door.forget`.

    Raises:
        NotFound: no token and no session has this id.
    """
    now = db.clock()
    with db.write() as session:
        token = session.scalar(select(AccessToken.id).where(AccessToken.public_id == name))
        ended = AccessSession.public_id == name if token is None else AccessSession.token_id == token
        known = session.scalar(select(AccessSession.id).where(ended).limit(1))
        if token is None and known is None:
            raise NotFound(f"There is no token and no session {name}. `parenting access list` shows them.")
        if token is not None:
            session.execute(
                update(AccessToken)
                .where(AccessToken.id == token, AccessToken.revoked.is_(None))
                .values(revoked=now)
            )
        session.execute(
            update(AccessSession).where(ended, AccessSession.revoked.is_(None)).values(revoked=now)
        )
        record(db, session, Kind.REVOCATION, f"{'session' if token is None else 'token'} {name[:8]}")
        tell_revoked(session)


def tell_revoked(session: Session) -> None:
    """Let all web processes read sessions and tokens again."""
    session.execute(update(Identity).values(access_revision=Identity.access_revision + 1))

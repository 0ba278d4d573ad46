"""The tables of access. Of a secret the hash is stored, with what it opens and for how long."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import Index
from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.access.roles import Role
from parenting.server.columns import OneOf
from parenting.server.public_ids import public_id
from parenting.server.table_root import Table, one_of

KINDS = ("opening", "program", "link")
"""opening: enters a browser once; program: a header of a program; link: the address for a parent."""
ROLES = tuple(str(role) for role in Role)


class AccessToken(Table):
    """A token that was handed out. No foreign key to its run: a run is deleted in pieces."""

    __tablename__ = "access_token"
    __table_args__ = (one_of("kind", KINDS), one_of("role", ROLES), Index(None, "run_id"))

    id: Mapped[int] = mapped_column(primary_key=True)
    public_id: Mapped[str] = mapped_column(default=public_id, unique=True, index=True)
    kind: Mapped[str] = mapped_column(OneOf(KINDS))
    digest: Mapped[str] = mapped_column(unique=True, index=True)  # the SHA-256 of the secret
    role: Mapped[str] = mapped_column(OneOf(ROLES))
    run_id: Mapped[int | None]  # the only run that it opens; null: all
    study: Mapped[str | None]  # the study that it was made for
    name: Mapped[str | None]  # what the researcher calls it
    client_id: Mapped[str | None]  # the name under which its parent answers; null: any
    made_by: Mapped[str]  # who made it (`Principal.who`, or a command)
    created: Mapped[datetime]
    expires: Mapped[datetime]
    last_used: Mapped[datetime | None]
    used: Mapped[datetime | None]  # when an opening token was used up
    revoked: Mapped[datetime | None]


class AccessSession(Table):
    """A browser's session."""

    __tablename__ = "access_session"
    __table_args__ = (one_of("role", ROLES), Index(None, "run_id"), Index(None, "token_id"))

    id: Mapped[int] = mapped_column(primary_key=True)
    public_id: Mapped[str] = mapped_column(default=public_id, unique=True, index=True)
    digest: Mapped[str] = mapped_column(unique=True, index=True)  # the SHA-256 of the cookie's secret
    token_id: Mapped[int | None]  # the token by which it was entered
    role: Mapped[str] = mapped_column(OneOf(ROLES))
    run_id: Mapped[int | None]
    name: Mapped[str | None]
    client_id: Mapped[str | None]
    created: Mapped[datetime]
    expires: Mapped[datetime]  # whatever is done with it
    last_used: Mapped[datetime]  # to within a minute; long before now it is idle
    revoked: Mapped[datetime | None]

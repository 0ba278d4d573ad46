"""The table of the audit log."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum

from sqlalchemy import text
from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.columns import OneOf
from parenting.server.table_root import Table, one_of


class Kind(StrEnum):
    """The kinds of entries."""

    LOGIN = "login"
    LOGOUT = "logout"
    REFUSAL = "refusal"
    TOKEN = "token"
    REVOCATION = "revocation"
    EXPORT = "export"
    DELETION = "deletion"
    OPERATOR = "operator"


KINDS = tuple(Kind)


class AuditEntry(Table):
    """An entry of the audit log. It holds nothing that people wrote, and outlives the run that it names."""

    __tablename__ = "audit"
    __table_args__ = (one_of("kind", KINDS),)

    id: Mapped[int] = mapped_column(primary_key=True)
    created: Mapped[datetime]
    kind: Mapped[str] = mapped_column(OneOf(KINDS))
    what: Mapped[str]  # "pause", "answers as csv", "cross_site"
    who: Mapped[str]  # "session abc12345", "command line (ada)"
    client: Mapped[str | None]  # the address that asked; null: a command on the machine
    run: Mapped[str | None]  # its public id
    count: Mapped[int] = mapped_column(default=1, server_default=text("1"))  # of refusals

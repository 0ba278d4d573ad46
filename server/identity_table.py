"""The table of the database's identity (`server.identity`)."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, text
from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.table_root import Table


class Identity(Table):
    """The identity of this database, in its only row (`server.identity`)."""

    __tablename__ = "database_identity"
    __table_args__ = (CheckConstraint("id = 1", name="one_row"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    uuid: Mapped[str]
    since: Mapped[datetime]
    copied_from: Mapped[str | None]  # the UUID that it had before it was given this one
    last_run: Mapped[int] = mapped_column(default=0, server_default=text("0"))  # the largest deleted number
    last_query: Mapped[int] = mapped_column(default=0, server_default=text("0"))
    # grows with each revocation, so that web processes need not read all sessions again and again
    access_revision: Mapped[int] = mapped_column(default=0, server_default=text("0"))

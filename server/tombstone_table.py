"""The table of what is left of deleted runs (`server.deletion`)."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.table_root import Table


class Tombstone(Table):
    """The remains of a deleted run: its number, its public id, and what it held. Nothing that people wrote.

    No foreign key: the run is gone.
    """

    __tablename__ = "tombstone"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # the number of the run
    public_id: Mapped[str] = mapped_column(unique=True, index=True)
    created: Mapped[datetime]  # when the run was started
    deleted: Mapped[datetime]  # when its deletion was confirmed
    gone: Mapped[datetime | None]  # when its last row was deleted
    held: Mapped[dict[str, Any]]  # `deletion.Held`

"""The table of worker processes (`server.workers`)."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.columns import Big
from parenting.server.table_root import Table


class Worker(Table):
    """A worker process that is alive; it deletes its row when it ends in order."""

    __tablename__ = "worker"

    name: Mapped[str] = mapped_column(primary_key=True)
    started: Mapped[datetime]
    heartbeat: Mapped[datetime]  # by the wall clock, for display
    epoch: Mapped[str | None]  # by the clock that decides (`server.store.clock`)
    mark: Mapped[float | None]
    # what it says of itself (`server.workers.Figures`); null: a worker of before, or one that says nothing
    runs: Mapped[int | None]
    lives: Mapped[int | None]
    busy: Mapped[float | None]
    memory: Mapped[int | None] = mapped_column(Big)
    waited: Mapped[float | None]

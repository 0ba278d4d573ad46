"""The table of an agent's moves, from which any episode of its life is shown again (`server.moves`)."""

from __future__ import annotations

from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.table_root import Table


class Moves(Table):
    """The moves of some thousand ticks, a byte a tick, compressed. The last row of a run grows.

    No foreign key, as in `tables.CheckpointPart`.
    """

    __tablename__ = "moves"

    run_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    part: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # counted from 0
    blob: Mapped[bytes]

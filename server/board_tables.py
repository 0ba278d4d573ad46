"""The tables of what a page shows of an agent's policy (`server.board`)."""

from __future__ import annotations

from sqlalchemy import text
from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.table_root import Table


class BoardStates(Table):
    """The states that the numbers of a run's snapshots belong to, in their order; they are only ever added.

    No foreign key, as in `tables.CheckpointPart`.
    """

    __tablename__ = "board_states"

    run_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    states: Mapped[int]
    complete: Mapped[bool]  # every state that can be reached; else those that were met
    blob: Mapped[bytes]  # compressed JSON: cells and rests


class BoardSnapshot(Table):
    """The numbers of all states after a tick: of the policy that acts, or of an earlier stage (Sec. 2.4)."""

    __tablename__ = "board_snapshot"

    run_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    tick: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    stage: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    frozen: Mapped[bool] = mapped_column(default=False, server_default=text("false"))  # of an earlier stage
    answers: Mapped[int]  # that the agent had heard
    states: Mapped[int]
    p_guid: Mapped[float]
    size: Mapped[int]  # bytes of `blob`
    blob: Mapped[bytes]  # compressed columns of `server.board.columns`

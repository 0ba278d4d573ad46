"""The tables of the reasons of questions and of the effects of answers (`server.why`)."""

from __future__ import annotations

from typing import Any

from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.compact import EFFECT, REASON
from parenting.server.compact_columns import Figures
from parenting.server.table_root import Table


class Reason(Table):
    """The reason of a question. Rows are only added; no foreign key, as in `tables.CheckpointPart`."""

    __tablename__ = "reason"

    run_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    tick: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # of the question
    why: Mapped[dict[str, Any]] = mapped_column(
        Figures(REASON)
    )  # `reads.why.GuidanceWhy` or `reads.why.PreferenceWhy`


class Effect(Table):
    """The policy in the asked state, some ticks after an answer. Rows are only added, as reasons are."""

    __tablename__ = "effect"

    run_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    tick: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # in which the answer was heard
    ticks: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # lived since; 0: before it
    policy: Mapped[dict[str, Any]] = mapped_column(
        Figures(EFFECT)
    )  # {"probabilities": of up, down, left and right}

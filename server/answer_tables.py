"""The table of answers, and the words that a parent says."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.columns import Hex, OneOf
from parenting.server.measures import Measures
from parenting.server.table_root import Table, one_of, only_where, unique_where

CHOICES = ("left", "right", "either", "neither")
SKIP = "skip"  # the parent cannot tell: this counts as no choice
SAID = (*CHOICES, SKIP)
PARENTS = ("human", "scripted")
SCRIPT = "scripted"  # the client of what a scripted parent answers, beside `parent`


class Answer(Table):
    """A parent's answer or skip. Rows are only ever added; one that supersedes another names its row."""

    __tablename__ = "answer"
    __table_args__ = (
        one_of("choice", SAID),
        UniqueConstraint("run_id", "number"),
        unique_where("uq_answer_standing", "standing", "query_id"),
        unique_where("uq_answer_first", "supersedes IS NULL", "query_id", "client_id"),
        Index(None, "query_id"),
        only_where("ix_answer_supersedes", "supersedes IS NOT NULL", "supersedes"),  # for deletions
        Index(None, "run_id", "applied_tick", unique=True),  # at most one answer is heard in a tick
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    query_id: Mapped[int] = mapped_column(ForeignKey("query.id"))
    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"))
    number: Mapped[int]
    choice: Mapped[str] = mapped_column(OneOf(SAID))
    parent: Mapped[str] = mapped_column(OneOf(PARENTS))
    client_id: Mapped[str]
    supersedes: Mapped[int | None] = mapped_column(ForeignKey("answer.id"))
    standing: Mapped[bool] = mapped_column(default=True)
    received: Mapped[datetime]
    replays: Mapped[int | None]  # how often its parent played the clips again; null: the client did not tell
    measured: Mapped[dict[str, Any] | None] = mapped_column(Measures)  # by the page (`server.measures`)
    applied_tick: Mapped[int | None]
    erased: Mapped[datetime | None]  # when its person's data were deleted (`server.erasing`); a skip since
    # the chain of hashes (server.chain)
    salt: Mapped[str | None] = mapped_column(Hex)
    digest: Mapped[str | None] = mapped_column(Hex)
    link: Mapped[str | None] = mapped_column(Hex)
    chained: Mapped[str | None]  # when it was hashed: with the answer, or by a migration

"""Schemas of the replies to what a parent says: an answer, a skip, a change, a withdrawal."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from parenting.server.schemas import Choice, Said, Schema


class StoredSchema(Schema):
    """The reply to an answer; the same answer always gets the same reply."""

    query: int
    run: int
    number: int
    """The number of the answer within its run, from 1."""
    choice: Choice
    received: datetime
    database: str
    run_public_id: str
    query_public_id: str


class SkippedSchema(Schema):
    """The reply to a skip."""

    outcome: Literal["set_aside", "put_back", "withdrawn"]
    """set_aside: the agent asks about another pair of moves. put_back: the clips are shown once more, after
    all other questions. withdrawn: they had been put back, and are not shown any more."""
    query: int
    run: int
    number: int | None
    """The number of the row among the run's answers; null if this skip was stored before."""
    database: str
    run_public_id: str
    query_public_id: str


class ChangedSchema(StoredSchema):
    """The reply to a change: the answer that stands now."""

    heard: bool
    """True if the agent has heard an earlier answer to this question; it hears this one as a correction."""


class WithdrawnSchema(Schema):
    """The reply to a withdrawal."""

    outcome: Literal["withdrawn", "heard"]
    """withdrawn: the question is open again and leased to this client. heard: the agent has heard the answer,
    and nothing was changed; the answer can be changed instead."""
    query: int
    run: int
    choice: Said | None
    """The answer or skip that was taken back, or that stands; null if this client gave none."""
    database: str
    run_public_id: str
    query_public_id: str

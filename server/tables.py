"""The tables: runs, queries, answers, events, metrics, checkpoints, moves, workers, jobs, and others.

The database enforces the invariants: one query for each run and tick, one standing answer for each query,
known words only. Times are UTC. JSON is stored in short forms (`server.compact_lists`); `Query.clips`
describes a clip.
"""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, UniqueConstraint, event, text
from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.access.tables import AccessSession, AccessToken
from parenting.server.answer_tables import (
    CHOICES,
    PARENTS,
    SAID,
    SKIP,
    Answer,
)
from parenting.server.audit.table import AuditEntry
from parenting.server.board_tables import BoardSnapshot, BoardStates
from parenting.server.columns import Big, OneOf, name_places
from parenting.server.compact import METRICS
from parenting.server.compact_columns import Clips, Figures
from parenting.server.identity_table import Identity
from parenting.server.moves_table import Moves
from parenting.server.person_tables import Person, PersonClient, PersonName
from parenting.server.public_ids import public_id
from parenting.server.statuses import (
    JOB_STATES,
    QUERY_STATUSES,
    RUN_STATUSES,
    WAITING,
    JobState,
    QueryStatus,
    RunStatus,
    Waiting,
)
from parenting.server.table_root import Table, one_of
from parenting.server.tombstone_table import Tombstone
from parenting.server.triggers import keep_deleted_numbers
from parenting.server.why_tables import Effect, Reason
from parenting.server.worker_table import Worker

__all__ = ["CHOICES", "PARENTS", "SAID", "SKIP", "AccessSession", "AccessToken", "Answer", "AuditEntry"]
__all__ += ["BoardSnapshot", "BoardStates", "Effect", "Identity", "Moves", "Person", "PersonClient"]
__all__ += ["PersonName", "Reason", "Table", "Tombstone", "Worker"]

KINDS = ("guidance", "preference")


def _public_id() -> Mapped[str]:
    """Return the column of a name that means the same forever, in whatever copy of the database."""
    return mapped_column(default=public_id, server_default=text("''"), unique=True, index=True)


class Run(Table):
    """A run: its settings, its progress, and the worker that raises it."""

    __tablename__ = "run"
    __table_args__ = (
        one_of("status", RUN_STATUSES),
        one_of("parent", PARENTS),
        one_of("waiting", WAITING, nullable=True),
        Index(None, "status"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)  # its number: a short name within this database
    public_id: Mapped[str] = _public_id()
    created: Mapped[datetime]
    name: Mapped[str | None]
    description: Mapped[str | None]
    tags: Mapped[str] = mapped_column(default="", server_default=text("''"))  # ",pilot,group a,"
    archived: Mapped[datetime | None]  # since when the list leaves it out
    deleting: Mapped[datetime | None]  # when its deletion was confirmed (`server.deletion`)
    world: Mapped[str]
    level: Mapped[str]
    level_text: Mapped[str]  # the level's file as it was at the start, header included
    legend: Mapped[dict[str, Any]]  # glyph -> tile name: the page needs no world's code
    brief: Mapped[dict[str, Any]]  # {"goal": ..., "danger": ...}
    config: Mapped[dict[str, Any]]  # agent.config.Config, whole
    preset: Mapped[str]
    seed: Mapped[int] = mapped_column(Big)
    parent: Mapped[str] = mapped_column(OneOf(PARENTS))
    script: Mapped[str | None]  # the script's errors, as `parents.grammar` reads them; null: people answer
    guidance_layout: Mapped[str] = mapped_column(OneOf(("one", "two")), default="one", server_default="two")
    practice: Mapped[str] = mapped_column(
        OneOf(("offered", "required")), default="offered", server_default="offered"
    )
    words: Mapped[str] = mapped_column(OneOf(("plain", "guide")), default="plain", server_default="plain")
    remarks: Mapped[bool] = mapped_column(default=True, server_default=text("false"))  # on hasty answers
    finish: Mapped[str] = mapped_column(default="never", server_default=text("'never'"))  # `server.finishes`
    # where it is
    status: Mapped[RunStatus] = mapped_column(default=RunStatus.ACTIVE)
    reason: Mapped[str | None]
    tick: Mapped[int] = mapped_column(default=0)  # the last tick reported, for display
    waiting: Mapped[Waiting | None]
    optimal: Mapped[bool] = mapped_column(default=False)
    maturity: Mapped[int] = mapped_column(default=1, server_default=text("1"))  # the stage T, for display
    speed: Mapped[float | None]  # ticks a second lately, for display
    answers: Mapped[int] = mapped_column(default=0)  # numbers its answers, in their own transactions
    retracted: Mapped[int] = mapped_column(default=0, server_default=text("0"))  # no more standing, or skips
    skipped: Mapped[int] = mapped_column(default=0, server_default=text("0"))  # skips not taken back
    # what the operator set, and may change while it lives; neither changes what the agent does
    goal: Mapped[int | None]  # answered questions after which the run rests
    pace: Mapped[float | None]  # ticks a second at most, for those who want to watch
    # what its parent is told of its progress
    milestones: Mapped[dict[str, Any] | None]  # name -> tick: what it did for the first time
    lesson: Mapped[dict[str, Any] | None]  # what the last answer changed (`schemas.LessonSchema`)
    # which worker raises it
    worker: Mapped[str | None]
    fencing_token: Mapped[int] = mapped_column(default=0)  # grows at each claim; every write checks it
    heartbeat: Mapped[datetime | None]  # its last sign of life by the wall clock, for display, and
    claim_epoch: Mapped[str | None]  # by the clock that decides (`server.store.clock`)
    claim_mark: Mapped[float | None]
    versions: Mapped[dict[str, Any] | None]  # torch build and threads: other ones give other bits
    error: Mapped[str | None]
    weights: Mapped[str | None]  # the sha256 of the pre-trained weights (`Weights`); none: fresh ones
    batch: Mapped[str | None]  # of trials that were raised together in tensors (`server.batches`), and
    trial: Mapped[int | None]  # which of them it is; null: a worker raises it
    origin: Mapped[dict[str, Any] | None]  # an earlier policy, answers or run that it began with (`origin`)

    @property
    def standing(self) -> int:
        """The number of answers that stand."""
        return self.answers - self.retracted


class Weights(Table):
    """Weights (Sec. 3.1.4), policies and answers that runs begin with, so that a worker needs no file."""

    __tablename__ = "weights"

    sha256: Mapped[str] = mapped_column(primary_key=True)
    name: Mapped[str]  # the file's name, for display
    blob: Mapped[bytes]
    created: Mapped[datetime]


class Query(Table):
    """A query of a run. A lease is a time, not a status, so nothing sticks (docs/queue.md)."""

    __tablename__ = "query"
    __table_args__ = (
        one_of("kind", KINDS),
        one_of("status", QUERY_STATUSES),
        UniqueConstraint("run_id", "tick"),
        Index(None, "run_id", "status", "kind"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    public_id: Mapped[str] = _public_id()
    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"))
    tick: Mapped[int]
    kind: Mapped[str] = mapped_column(OneOf(KINDS))
    maturity: Mapped[int]
    clips: Mapped[dict[str, Any]] = mapped_column(Clips)
    """{"left": CLIP, "right": CLIP}, CLIP = {"actions": ["up", ...], "length": n, "frames": [n + 1 of
    {"ground": [rows], "observed": [rows], "agent": [row, column], "box": [row, column] or null}]}."""
    status: Mapped[QueryStatus] = mapped_column(default=QueryStatus.OPEN)
    put_back: Mapped[bool] = mapped_column(default=False, server_default=text("false"))  # skipped once
    posted: Mapped[datetime]
    votes: Mapped[int] = mapped_column(default=0, server_default=text("0"))  # heard on this pair and pause
    policy_stage: Mapped[int | None]  # which policy asked: the stage T that it was in, and
    policy_steps: Mapped[int | None]  # its gradient steps in that stage; null: asked before these were kept
    leased: Mapped[datetime | None]  # when it was first shown to somebody; null: never, or not kept then
    leased_until: Mapped[datetime | None]  # by the wall clock, for display
    leased_by: Mapped[str | None]
    lease_epoch: Mapped[str | None]  # by the clock that decides (`server.store.clock`)
    lease_begin: Mapped[float | None]
    lease_end: Mapped[float | None]
    withdrawn_tick: Mapped[int | None]  # before which the agent stopped waiting for it; null: with its run


class OperatorEvent(Table):
    """An operator event (agent.events), and the tick before which it was applied."""

    __tablename__ = "event"
    __table_args__ = (Index(None, "run_id", "applied_tick"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"))
    kind: Mapped[str]
    payload: Mapped[dict[str, Any]]
    created: Mapped[datetime]
    applied_tick: Mapped[int | None]


class Metric(Table):
    """The metrics of a tick: name -> number, or null where it was not finite."""

    __tablename__ = "metric"

    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    tick: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    values: Mapped[dict[str, Any]] = mapped_column(Figures(METRICS))


class Checkpoint(Table):
    """The whole state of an agent after a tick. The last two of a run are kept."""

    __tablename__ = "checkpoint"
    __table_args__ = (Index(None, "run_id", "tick"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"))
    tick: Mapped[int]
    blob: Mapped[bytes]
    sha256: Mapped[str]  # of all its bytes
    created: Mapped[datetime]
    parcel: Mapped[str | None]  # names its parts; None: `blob` holds all its bytes


class CheckpointPart(Table):
    """A part of a large checkpoint. Parts whose parcel no checkpoint names are of one that is not complete.

    No foreign key: `pg_restore --clean` of a dump that is older than this table has to drop the run's.
    """

    __tablename__ = "checkpoint_part"
    __table_args__ = (UniqueConstraint("parcel", "place"), Index(None, "run_id"))

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[int]
    parcel: Mapped[str]
    place: Mapped[int]
    blob: Mapped[bytes]


class Job(Table):
    """A job: what a page asks of any worker, and its result (`server.jobs`). Old ones are deleted.

    No foreign key, as in `CheckpointPart`.
    """

    __tablename__ = "job"
    __table_args__ = (one_of("state", JOB_STATES), Index(None, "state"), Index(None, "run_id"))

    id: Mapped[int] = mapped_column(primary_key=True)
    public_id: Mapped[str] = mapped_column(default=public_id, unique=True, index=True)
    run_id: Mapped[int]
    kind: Mapped[str]  # one of `server.job_kinds.KINDS`, which versions to come add to
    payload: Mapped[dict[str, Any]]
    client_id: Mapped[str]  # who asked
    created: Mapped[datetime]  # by the wall clock, for display, and
    asked_epoch: Mapped[str]  # by the clock that decides (`server.store.clock`)
    asked_mark: Mapped[float]
    state: Mapped[JobState] = mapped_column(default=JobState.WAITING)
    result: Mapped[dict[str, Any] | None]  # while it goes on, its progress
    reason: Mapped[str | None]  # why it failed, in a sentence
    # which worker has it
    worker: Mapped[str | None]
    fencing_token: Mapped[int] = mapped_column(default=0)  # grows at each claim: the number of tries
    claim_epoch: Mapped[str | None]
    claim_mark: Mapped[float | None]


name_places(Table.metadata)
event.listen(Table.metadata, "after_create", keep_deleted_numbers)

"""A person's answers leave X of an agent that others raised, too. This needs torch, as a worker has.

The run is taken from its worker, lived again up to the end of its record, and its X is rebuilt from the
answers of the others, as a correction rebuilds it (`agent.amendment`). Then, in one transaction, the new
checkpoint is stored, all earlier ones and every snapshot go, the person's rows are overwritten, and a note in
the log says at which tick. Whoever is killed before has changed nothing.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from functools import partial

import structlog
import torch
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from parenting.agent import amendment
from parenting.agent.amendment import Amend
from parenting.agent.query import Answer as Said
from parenting.agent.query import Choice
from parenting.agent.state import AgentState
from parenting.server import erasure, runs
from parenting.server.checkpoint_parts import sweep_parts
from parenting.server.checkpoints import save_checkpoint
from parenting.server.db import Database
from parenting.server.erasure import ERASED
from parenting.server.errors import LostClaimError, StoreError
from parenting.server.notes import PersonErased, add_note
from parenting.server.persons import AT_ONCE, find_person
from parenting.server.progress import report_progress
from parenting.server.queue.taken import Taken, standing_at
from parenting.server.runs import CLAIM_SECONDS, Claim
from parenting.server.session import RunSession
from parenting.server.snapshot import pack
from parenting.server.statuses import OVER, QueryStatus
from parenting.server.tables import (
    SKIP,
    Answer,
    BoardSnapshot,
    Checkpoint,
    CheckpointPart,
    Effect,
    Query,
    Run,
)

log = structlog.get_logger()

NAME = "deletion"
"""The name of whoever holds a run for so long."""
SIGN_SECONDS = 1.0
"""Seconds between two signs of life of a run that is held."""
TRIES = 40
"""Times that a run is asked for which a worker, or another deletion, takes up meanwhile."""


def delete_person(db: Database, pseudonym: str) -> bool:
    """Delete a person's data, or go on with it; return whether the store's file was overwritten as well.

    Raises:
        NotFound: there is no such person.
    """
    erasure.begin(db, pseudonym)
    with db.read() as session:
        person_id = find_person(session, pseudonym).id
    return go_on(db, person_id)


def go_on(db: Database, person_id: int) -> bool:
    """Go on with the deletion of a person who is marked; return whether all is done.

    Raises:
        LostClaimError: a run is taken up by others again and again.
    """
    left, tries = erasure.go_on_without_torch(db, person_id), 0
    while left.plan.shared:
        try:
            leave(db, left.plan.shared[0], left.clients)
        except LostClaimError:
            if (tries := tries + 1) == TRIES:
                raise
            time.sleep(CLAIM_SECONDS / 10)
        left = erasure.left_of(db, person_id)
    return erasure.finish(db, person_id)


def leave(db: Database, run_id: int, clients: Collection[str]) -> int:
    """Let the answers of some clients leave a run's X, and erase them; return the tick at which they left.

    Raises:
        LostClaimError: a worker took the run up meanwhile; nothing was changed.
    """
    mine = _take_over(db, run_id)
    with _held(db, mine):
        life = RunSession(db, mine, runs.get_run(db, run_id), lambda: None)
        while life.last_tick < life.record_ends:
            life.tick()
        life.saved = life.saved._replace(state=_without(db, life, clients))
        life.lived.write()
        life.why.write()
        erase = partial(_erase, db=db, tick=life.last_tick, clients=frozenset(clients))
        save_checkpoint(db, mine, life.last_tick, pack(life.saved), erase)
        sweep_parts(db, mine)
        life.board.write(life.saved, last=True)
        return life.last_tick


@contextmanager
def _held(db: Database, mine: Claim) -> Iterator[None]:
    """Hold a claim within the block, by signs of life from a thread of their own, and let go of it.

    A worker gives one for all its runs. To relive a run, to rebuild X or to write a checkpoint may take
    longer than a claim holds without.
    """
    over = threading.Event()
    signs = threading.Thread(target=_sign, args=(db, mine, over), name="signs of a deletion", daemon=True)
    signs.start()
    try:
        yield
    finally:
        over.set()
        signs.join()
        runs.let_go(db, [mine])


def _sign(db: Database, mine: Claim, over: threading.Event) -> None:
    while not over.wait(SIGN_SECONDS):
        try:
            report_progress(db, mine)
        except LostClaimError:  # the next write says so
            return
        except StoreError as error:
            log.warning("a deletion could not give a sign of life", why=error.message)


def _take_over(db: Database, run_id: int) -> Claim:
    """Claim a run, over or not. A worker that raises it loses it, and claims it again once it is free.

    Raises:
        LostClaimError: another process deletes the same data at this moment.
    """
    with db.write() as session:
        run, mark = runs.hold(session, run_id), db.mark(session)
        if run.worker == NAME and mark.is_recent(run.claim_epoch, run.claim_mark, CLAIM_SECONDS):
            raise LostClaimError(f"Run {run_id}: another process deletes a person's data of it.")
        run.worker, run.fencing_token = NAME, run.fencing_token + 1
        run.heartbeat, run.claim_epoch, run.claim_mark = db.clock(), mark.epoch, mark.seconds
        return Claim(run.id, NAME, run.fencing_token)


def _without(db: Database, life: RunSession, clients: Collection[str]) -> AgentState:
    """Return the agent with X of the others' answers alone."""
    with db.read() as session:
        taken = standing_at(session, life.run.id, life.last_tick)
    theirs = [one for one in taken if one.answer.client_id in clients and one.answer.choice != SKIP]
    if not theirs:
        return life.saved.state
    others = [_heard(life, one) for one in taken if one not in theirs]
    replaced = _heard(life, theirs[0])
    nothing = Said(query=replaced.query, choice=torch.full_like(replaced.choice, int(Choice.SKIP)))
    event = Amend([*life.parent.inherited, *others], replaced, nothing)
    return amendment.amend(life.saved.config, life.saved.state, event)


def _heard(life: RunSession, one: Taken) -> Said:
    return life.parent.in_tensors(one.answer, one.query)


def _erase(
    session: Session, run: Run, kept: int, *, db: Database, tick: int, clients: frozenset[str]
) -> None:
    """Overwrite what some clients said in a run, in the transaction that stores its new checkpoint.

    Args:
        session: The transaction.
        run: The run, locked.
        kept: The number of the new checkpoint.
        db: The database, for its clock.
        tick: The tick at which the answers left X.
        clients: Who gave them.
    """
    rows = select(Answer, Query).join(Query, Answer.query_id == Query.id)
    found = session.execute(rows.where(Answer.run_id == run.id, Answer.client_id.in_(clients))).all()
    for answer, query in found:
        _overwrite(run, answer, query, db)
    _remove_pictures(session, run.id, kept, [answer.applied_tick for answer, _ in found])
    run.lesson = None
    add_note(session, db, run.id, tick, PersonErased(answers=len(found)))


def _overwrite(run: Run, answer: Answer, query: Query, db: Database) -> None:
    """Make an answer a skip of nobody. Its place in the chain stays: the digest alone tells nothing."""
    counted = answer.standing and answer.choice != SKIP
    if answer.standing and query.status == QueryStatus.ANSWERED:  # the agent has not heard it
        answer.standing = False
        query.status = QueryStatus.WITHDRAWN if run.status in OVER else QueryStatus.OPEN
        run.retracted += counted
        run.skipped -= not counted
    elif counted:
        run.retracted, run.skipped = run.retracted + 1, run.skipped + 1
    answer.choice, answer.client_id, answer.erased = SKIP, ERASED, db.clock()
    answer.received = answer.erased
    answer.salt = answer.measured = answer.replays = None
    query.leased = None


def _remove_pictures(session: Session, run_id: int, kept: int, heard: Sequence[int | None]) -> None:
    """Delete older checkpoints, all snapshots, and what the erased answers changed."""
    parcel = session.scalar(select(Checkpoint.parcel).where(Checkpoint.id == kept))
    session.execute(delete(Checkpoint).where(Checkpoint.run_id == run_id, Checkpoint.id != kept))
    parts = delete(CheckpointPart).where(CheckpointPart.run_id == run_id)
    session.execute(parts if parcel is None else parts.where(CheckpointPart.parcel != parcel))
    session.execute(delete(BoardSnapshot).where(BoardSnapshot.run_id == run_id))
    ticks = [tick for tick in heard if tick is not None]
    for first in range(0, len(ticks), AT_ONCE):
        part = Effect.tick.in_(ticks[first : first + AT_ONCE])
        session.execute(delete(Effect).where(Effect.run_id == run_id, part))

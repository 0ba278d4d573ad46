"""Verify a stored run: its answers by their chain of hashes, its bits by a replay, its X by its answers.

Bits are those of one machine. Where the run was raised by several, or by another one than this, they are not
comparable, and what is exact on every machine is checked: the answers, their order, and X.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

from parenting.agent import amendment, guidance, maturation
from parenting.agent.amendment import Amend
from parenting.agent.config import Config
from parenting.agent.events import Change, Mature
from parenting.agent.init import world_of
from parenting.agent.state import AgentState
from parenting.parents.replay import ReplayParent
from parenting.server.batches import refuse_if_of_batch
from parenting.server.begun import inherited
from parenting.server.chain import Checked, check
from parenting.server.db import Database
from parenting.server.queue.taken import standing_at
from parenting.server.reads.record import StoredRecord, UnreadableRecordError
from parenting.server.recall import recall
from parenting.server.replay import Progress, Relived, comparable_until, equal, first_erased, relive, silent
from parenting.server.runs import get_run
from parenting.server.snapshot import DivergedError, Snapshot, first_snapshot, initial_weights

EXACT = "Bits are not comparable there; the answers, their order and X are exact on every machine."
PADDED = {"s0": "states", "local_state": "states", "digest": "states"}
"""Tensors of X with a place for each state; the others have one for each row."""


@dataclass(frozen=True)
class Verified:
    """The result of a verification."""

    run: int
    chain: Checked
    checkpoint: int | None  # the tick of the last good checkpoint; None: there is none yet
    machine: str | None  # a sentence on why bits are not comparable; None: they are
    replayed: Relived | None  # where bits are comparable
    x: str | None  # a sentence on where X is not what the answers make it; None: it is

    @property
    def sound(self) -> bool:
        """Return whether nothing was found."""
        bits = self.replayed is None or self.replayed.equal
        return not self.chain.problems and self.x is None and bits


def verify(db: Database, run_id: int, progress: Progress = silent) -> Verified:
    """Verify a run up to its last good checkpoint. It writes nothing.

    Raises:
        NotFound: there is no such run.
        DamagedRowError: its row cannot be read.
    """
    run = get_run(db, run_id)
    refuse_if_of_batch(run)
    chain = check(db, run_id)
    config = Config.model_validate(run.config)
    world = world_of(run.world, run.level_text, config)
    weights = initial_weights(db, run, world)
    recalled = recall(db, run, world, config, weights)
    if recalled.sha256 is None:
        return Verified(run_id, chain, None, None, None, None)
    begun = first_snapshot(db, run, world, config, weights)
    record = StoredRecord(db, run_id, world, config.max_clip_length)
    record.inherited = inherited(db, run, world, config)
    erased = first_erased(db, run_id) is not None
    x = (
        _x_of_rest(db, run_id, recalled.tick, recalled.saved, record)
        if erased
        else _x(begun, recalled.saved, recalled.tick, ReplayParent(record))
    )
    try:
        until = comparable_until(db, run)
    except DivergedError as error:
        return Verified(run_id, chain, recalled.tick, f"{error.message} {EXACT}", None, x)
    machine = None if until is None else f"Another machine went on with the run at tick {until + 1}. {EXACT}"
    return Verified(run_id, chain, recalled.tick, machine, relive(db, run_id, progress), x)


def x_of_record(begun: Snapshot, last: int, parent: ReplayParent) -> AgentState:
    """Return an agent that has heard the answers and events of a record, and done nothing else.

    Its X, its stage and its count of answers are exact on every machine.

    Raises:
        UnreadableRecordError: rows of the record are damaged.
    """
    state, config = begun.state, begun.config
    for _ in range(last):
        for event in parent.events(state):
            match event:
                case Mature():
                    state = maturation.mature(config, state, torch.ones_like(state.waiting))
                case Change(name=name, value=value):
                    config = config.model_copy(update={name: value})
                case Amend():
                    state = amendment.amend(config, state, event)
        state = guidance.learn(config, state, parent.take(state))
        state = maturation.grow(config, state)
        state = state.replace(keys=state.keys.next())
    return state


def _x(begun: Snapshot, kept: Snapshot, last: int, parent: ReplayParent) -> str | None:
    try:
        heard = x_of_record(begun, last, parent)
    except UnreadableRecordError as error:
        return str(error)
    for name in ("maturity", "answered"):
        if not equal(getattr(heard, name), getattr(kept.state, name)):
            return f"The checkpoint's {name} is not what the answers make it."
    differ = [name for name, ours, theirs in _pairs(heard, kept.state) if not equal(ours, theirs)]
    return f"X is not what the answers make it: {', '.join(differ)} differ." if differ else None


def _x_of_rest(db: Database, run_id: int, last: int, kept: Snapshot, record: StoredRecord) -> str | None:
    """Hold X to the answers that were left, where others were erased: what X was in between is not known."""
    with db.read() as session:
        taken = standing_at(session, run_id, last)
    heard = [*record.inherited, *(record.in_tensors(one.answer, one.query) for one in taken)]
    rest = kept.state.replace(x=amendment.rebuilt(kept.config, kept.state, heard))
    differ = [name for name, ours, theirs in _pairs(rest, kept.state) if not equal(ours, theirs)]
    return f"X is not what the answers make it: {', '.join(differ)} differ." if differ else None


def _pairs(one: AgentState, other: AgentState) -> Iterator[tuple[str, Tensor, Tensor]]:
    """Return the pieces of both X, without the room that is kept for more."""
    theirs = other.x.tensors()
    for name, ours in one.x.tensors().items():
        if ours.dim() == 1:
            yield name, ours, theirs[name]
            continue
        count = PADDED.get(name, "rows")
        yield name, ours[:, : int(one.x.tensors()[count][0])], theirs[name][:, : int(theirs[count][0])]

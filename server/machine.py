"""Another machine goes on with a run: its bits differ, so the record stands where the two disagree.

A run is a function of its record and of the machine: of torch's build, its threads, and the CPU. Where a run
is taken up by another machine than before, a note in its log says so, and from its last checkpoint to the end
of the record the agent follows the record: recorded answers and events are heard at their ticks, so X is what
the parent said; recorded questions stand, whatever the agent would ask now. After that it lives on as usual.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import structlog
import torch

from parenting.agent.query import Query, QueryKind
from parenting.agent.state import AgentState
from parenting.server.db import Database
from parenting.server.notes import CheckpointDamaged, MachineChanged, Note, add_note, notes
from parenting.server.recall import Recalled
from parenting.server.runs import Claim, held
from parenting.server.snapshot import DivergedError, changed, versions
from parenting.server.tables import Run

log = structlog.get_logger()


def change(
    recalled: Recalled,
    before: dict[str, Any] | None,
    here: dict[str, Any],
    record_ends: int,
    known: Sequence[tuple[int, Note]],
) -> MachineChanged | None:
    """Return the note to write when a run is taken up; None where it is the machine of before.

    Args:
        recalled: The run as its last good checkpoint left it.
        before: The machine that raised the run last; None if none has yet.
        here: This machine.
        record_ends: The last tick of the record.
        known: The notes of the run.
    """
    tick = recalled.tick + 1
    written = recalled.versions or before
    noted = any(isinstance(note, MachineChanged) and at == tick and note.after == here for at, note in known)
    if changed(before, here) or (changed(written, here) and not noted):
        last = written if changed(written, here) else before
        return MachineChanged(before=last or {}, after=here, until=record_ends)
    return None


def take_up(db: Database, mine: Claim, run: Run, recalled: Recalled, record_ends: int) -> int:
    """Say in a run's log which checkpoints were passed over, and whether this is another machine than before.

    Returns:
        The last tick whose record another machine has written; -1 if there is none.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    for passed in recalled.passed:
        log.warning("checkpoint passed over", run=run.id, tick=passed.tick, why=passed.note.reason)
    known = notes(db, run.id)
    fresh: list[tuple[int, Note]] = [(one.tick, one.note) for one in recalled.passed if not one.noted]
    other = change(recalled, run.versions, versions(), record_ends, known)
    if other is not None:
        fresh.append((recalled.tick + 1, other))
    write(db, mine, fresh)
    return followed_until([*known, *fresh])


def diverged(db: Database, mine: Claim, run: Run, recalled: Recalled, tick: int, record_ends: int) -> None:
    """Judge a run that departed from its record on what seems to be the machine that wrote it.

    If the CPU of before was not recorded, it may have been another one, and the run follows its record.

    Raises:
        DivergedError: it is the same machine. The checkpoint that the run went on from is passed over from
            now on, as the log says.
        LostClaimError: another worker trains this run now.
    """
    here, before = versions(), recalled.versions or run.versions or {}
    if not before.keys() >= here.keys():
        write(db, mine, [(tick, MachineChanged(before=before, after=here, until=record_ends))])
        return
    if recalled.sha256 is not None:
        reason = f"the run that went on from here departed from its record at tick {tick}"
        begun = CheckpointDamaged(sha256=recalled.sha256, reason=reason)
        write(db, mine, [(recalled.tick, begun)])
    raise DivergedError(f"The agent asked another question when tick {tick} was replayed.")


def write(db: Database, mine: Claim, fresh: Sequence[tuple[int, Note]]) -> None:
    """Store this machine as the one that raises a run, and notes at their ticks, in one transaction."""
    with db.write() as session:
        run = held(session, mine)
        run.heartbeat, run.versions = db.clock(), versions()
        run.claim_epoch, run.claim_mark = db.mark(session)
        for tick, note in fresh:
            add_note(session, db, run.id, tick, note)


def followed_until(known: Sequence[tuple[int, Note]]) -> int:
    """Return the last tick whose record another machine has written; -1 if there is none."""
    return max((note.until for _, note in known if isinstance(note, MachineChanged)), default=-1)


def follow(state: AgentState, recorded: Query | None, asked: Query) -> AgentState:
    """Return the agent as the record has it after a tick in which it asked otherwise.

    Where the record has guidance, the agent stands where that question was asked and waits for its answer:
    nothing is ever approved for another place. Where the record has none, it does not wait.

    Args:
        state: The agent after its own tick.
        recorded: The question that the record has at this tick.
        asked: The question that the agent asked itself.
    """
    if recorded is not None and bool(recorded.kind[0] == QueryKind.GUIDANCE):
        place = state.world.replace(
            board=recorded.board[:, 0, 0].to(state.world.board),
            agent=recorded.agent[:, 0, 0].to(state.world.agent),
            box=recorded.box[:, 0, 0].to(state.world.box),
            terminated=torch.zeros_like(state.world.terminated),
        )
        return state.replace(world=place, waiting=torch.ones_like(state.waiting))
    if bool(asked.kind[0] == QueryKind.GUIDANCE):
        calm = {name: torch.zeros_like(getattr(state, name)) for name in ("waiting", "refused", "set_aside")}
        return state.replace(**calm)
    return state

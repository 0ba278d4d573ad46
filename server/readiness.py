"""The right of an agent to its next tick: it never outruns its parent (docs/queue.md). And its waits."""

from __future__ import annotations

from parenting.server.queue.worker_side import Watch
from parenting.server.snapshot import Snapshot
from parenting.server.statuses import Waiting


def may_live_on(saved: Snapshot, seen: Watch) -> bool:
    """Return whether the next tick may pass, after a look at the mailbox."""
    if seen.corrections:
        return True
    if seen.idle:
        return False
    if seen.events:
        return True
    if seen.open_guidance or seen.open_preferences > saved.config.max_open_preferences:
        return False
    return not bool(saved.state.waiting) or (seen.answers > 0 and not bool(saved.state.all_refused))


def waits_for(saved: Snapshot, seen: Watch) -> Waiting | None:
    """Return whom an agent waits for, after a look at the mailbox."""
    if bool(saved.state.all_refused):
        return Waiting.STUCK
    if bool(saved.state.unsure):
        return Waiting.UNSURE
    if seen.open_guidance:
        return Waiting.GUIDANCE
    return Waiting.PREFERENCES if seen.open_preferences else None


def surely_waits_for(saved: Snapshot) -> Waiting | None:
    """Return whom the agent of a person waits for, where that is sure before a look at the mailbox."""
    state = saved.state
    asks = bool(state.waiting) and not bool(state.all_refused) and not bool(state.unsure)
    return Waiting.GUIDANCE if asks else None

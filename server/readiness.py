"""The right of an agent to its next tick: it never outruns its parent (docs/queue.md)."""

from __future__ import annotations

from parenting.server.queue.worker_side import Watch
from parenting.server.snapshot import Snapshot


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

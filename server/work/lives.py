"""The lives that stay in memory: those that go on, and of those that wait the ones that had a turn lately.

The others come back from their checkpoints once something is new for them. That takes some hundredths of a
second, and nothing of the agent depends on it: it is what happens to every life when a worker begins.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, MutableMapping, Sequence

from sqlalchemy import ColumnElement, exists, func, select

from parenting.server.db import Database
from parenting.server.queue.worker_side import Watch
from parenting.server.session import RunSession
from parenting.server.statuses import Waiting
from parenting.server.tables import Answer, Checkpoint, OperatorEvent, Query, Run


class Lives:
    """The lives of a worker's runs: in memory, or asleep in their checkpoints."""

    def __init__(
        self,
        sessions: MutableMapping[int, RunSession],
        most: float = math.inf,
        most_bytes: float = math.inf,
    ) -> None:
        """Bound what is in memory; `sessions` are the lives there, and `most_bytes` is for their tensors."""
        self.sessions, self.most, self.most_bytes = sessions, most, most_bytes
        self.asleep: set[int] = set()
        # When each was taken up or its last tick passed, and its bytes.
        self._used: dict[int, tuple[float, int]] = {}

    def used(self, run_id: int) -> None:
        """Take note that a run has had a turn. While it waits no tick passes, and it counts as not used."""
        session = self.sessions.get(run_id)
        if session is not None:
            begun = self._used[run_id][0] if run_id in self._used else time.monotonic()
            self._used[run_id] = max(begun, session.lived_at), _bytes(session)

    def sleeps(self, run_id: int, seen: Watch) -> bool:
        """Return whether a run has no life in memory and needs none: it would only go on waiting."""
        if run_id not in self.asleep:
            return False
        news = seen.answers or seen.events or seen.corrections
        if not news and (seen.open_guidance or seen.idle):
            return True
        self.asleep.discard(run_id)
        return False

    def too_many(self, at_rest: Collection[int]) -> Sequence[int]:
        """Return the lives that should leave memory, of those at rest, the least recently used first."""
        used = dict(self._used)
        number, size = len(self.sessions), sum(size for _, size in used.values())
        if number <= self.most and size <= self.most_bytes:
            return []
        leaving = []
        for run_id in sorted(self.sessions.keys() & at_rest, key=lambda one: used.get(one, (0.0, 0))):
            if number <= self.most and size <= self.most_bytes:
                break
            leaving.append(run_id)
            number, size = number - 1, size - used.get(run_id, (0.0, 0))[1]
        return leaving

    def guided(self) -> set[int]:
        """Return the runs in memory that have reported that they wait for guidance.

        They can leave before their next checkpoint is due: leaving writes one.
        """
        waiting = list(self.sessions.items())
        return {run_id for run_id, one in waiting if one.whole and one.waiting is Waiting.GUIDANCE}

    def leave(self, run_id: int) -> None:
        """Let a life leave memory; its run still waits."""
        self.sessions.pop(run_id, None)
        self._used.pop(run_id, None)
        self.asleep.add(run_id)

    def forget(self, run_id: int) -> None:
        """Take note that this worker does not raise a run any more."""
        self._used.pop(run_id, None)
        self.asleep.discard(run_id)

    def claimed(self, db: Database, fresh: Sequence[int], claimed: int) -> None:
        """Leave runs asleep that were claimed beyond what memory should hold, where they surely wait.

        Args:
            db: The database.
            fresh: The runs that were claimed just now.
            claimed: The number of all runs of this worker, those included.
        """
        room = max(0, self.most - (claimed - len(fresh)))
        beyond = fresh[int(room) :] if room < len(fresh) else []
        if beyond:
            with db.read() as session:
                self.asleep.update(session.scalars(select(Run.id).where(Run.id.in_(beyond), *_WAITS)))


def _bytes(session: RunSession) -> int:
    return sum(part.numel() * part.element_size() for part in session.saved.state.tensors().values())


def _none_after(*conditions: ColumnElement[bool]) -> ColumnElement[bool]:
    return ~exists().where(*conditions).correlate(Run)


_WAITS = (
    Run.waiting == Waiting.GUIDANCE,
    Run.origin.is_(None),
    Run.tick == select(func.max(Checkpoint.tick)).where(Checkpoint.run_id == Run.id).scalar_subquery(),
    _none_after(Query.run_id == Run.id, Query.tick > Run.tick),
    _none_after(Answer.run_id == Run.id, Answer.applied_tick > Run.tick),
    _none_after(OperatorEvent.run_id == Run.id, OperatorEvent.applied_tick > Run.tick),
)
"""The run has reported at its last checkpoint that it waits for guidance, and its record ends there: taken
up, it would find the same question open. Any other is taken up at once, and repeats what it has to."""

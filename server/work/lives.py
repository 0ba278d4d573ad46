"""The lives that stay in memory: those that go on, and of those that wait the ones that had a turn lately.

The others come back from their checkpoints once something is new for them. That takes some hundredths of a
second, and nothing of the agent depends on it: it is what happens to every life when a worker begins.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Mapping, MutableMapping, Sequence

from sqlalchemy import ColumnElement, exists, func, select

from parenting.server.db import Database
from parenting.server.queue.worker_side import Watch
from parenting.server.session import RunSession
from parenting.server.statuses import Waiting
from parenting.server.tables import Answer, Checkpoint, OperatorEvent, Query, Run

FULL_SHARE = 10
"""Where memory is full, a tenth of the lives that it holds leave in one round for those to come, or where all
of them go on, so many may come beyond."""


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
        self._may_come: float = most  # in this round of turns
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
        if _waits(seen):
            return True
        self.asleep.discard(run_id)
        return False

    def comes(self, run_id: int, seen: Watch) -> bool:
        """Return whether a run that has no life in memory needs one."""
        return run_id not in self.asleep or not _waits(seen)

    def too_many(self, at_rest: Collection[int], coming: int = 0) -> Sequence[int]:
        """Return the lives that should leave memory, of those at rest, the least recently used first.

        Args:
            at_rest: The runs that only wait.
            coming: The number of runs that wait until they can be taken up; some of them get room.
        """
        used = dict(self._used)
        number, size = self._expected(coming)
        leaving = []
        for run_id in sorted(self.sessions.keys() & at_rest, key=lambda one: used.get(one, (0.0, 0))):
            if number <= self.most and size <= self.most_bytes:
                break
            leaving.append(run_id)
            number, size = number - 1, size - used.get(run_id, (0.0, 0))[1]
        return leaving

    def crowded(self, coming: int = 0) -> bool:
        """Return whether some lives should leave, if so many others are coming."""
        number, size = self._expected(coming)
        return number > self.most or size > self.most_bytes

    def _expected(self, coming: int) -> tuple[int, int]:
        """Return the number of lives in memory and their bytes, some that are to come counted in."""
        size = sum(size for _, size in list(self._used.values()))
        return len(self.sessions) + min(coming, self._some), size

    @property
    def _some(self) -> int:
        return 1 if math.isinf(self.most) else max(1, int(self.most) // FULL_SHARE)

    def begin_round(
        self,
        seen: Mapping[int, Watch],
        due: Collection[int],
        working: Collection[int],
        slow: Collection[int] = (),
    ) -> None:
        """Count how many lives may come in a round of turns.

        Where memory is full none does, as long as some life is about to leave, and else a few: a thousand
        runs that begin at once would otherwise all be in memory for a moment, and the C library gives back
        none of it.

        Args:
            seen: What was seen of each run.
            due: The runs whose turn is due.
            working: The runs whose turn goes on; some of them are being taken up.
            slow: Those of them whose turn takes long: nobody waits until these leave.
        """
        here, guided = set(self.sessions), self.guided()
        self._may_come = self.most - len(here | set(working))
        if self._may_come <= 0:
            leaving = here.intersection(guided.union(due, working), seen).difference(slow)
            self._may_come = 0 if any(_waits(seen[one]) for one in leaving) else self._some

    def may_come(self, run_id: int, seen: Watch) -> bool:
        """Return whether a run without a life in memory may have its turn now, and so be taken up.

        A run to which somebody has said something does not wait for that, nor one that sleeps on.
        """
        if seen.answers or seen.corrections or (run_id in self.asleep and _waits(seen)):
            return True
        self._may_come -= 1
        return self._may_come >= 0

    def guided(self) -> set[int]:
        """Return the runs in memory that have reported that they wait for guidance.

        They can leave before their next checkpoint is due: leaving writes one.
        """
        waiting = [(run_id, one) for run_id, one in list(self.sessions.items()) if one.whole]
        return {i for i, one in waiting if one.waiting is Waiting.GUIDANCE and not one.unmeasured}

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


def _waits(seen: Watch) -> bool:
    """Return whether an agent would only go on waiting."""
    news = seen.answers or seen.events or seen.corrections
    return not news and bool(seen.open_guidance or seen.idle)


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

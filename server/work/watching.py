"""The news of the runs that a worker raises: one statement for all of them, whenever somebody commits.

It reads what any verb of a parent or an operator changes. Only where that differs from the last look, or
where a turn of the worker itself may have changed more, is a run looked at as a whole. So a commit costs a
worker of a thousand waiting runs a few milliseconds, and a worker to which nothing happens nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import text

from parenting.server.db import Database
from parenting.server.queue import worker_side
from parenting.server.queue.worker_side import Watch
from parenting.server.runs import Claim

_MARKS = text(
    "SELECT id, fencing_token, status, answers, retracted, goal, pace, (SELECT count(*) FROM event"
    " WHERE event.run_id = run.id AND event.applied_tick IS NULL)"
    " FROM run WHERE worker = :worker AND status IN ('active', 'paused')"
)


@dataclass(frozen=True)
class News:
    """The result of a look."""

    found: Mapping[int, Watch]
    """The runs that may have changed."""
    lost: Collection[int]
    """The runs that another worker raises now, or nobody, though this one had claimed them."""
    unknown: Sequence[Claim]
    """The claims that the store has of this worker, of which it does not know."""


class Watching:
    """The watch of one worker over its runs."""

    def __init__(self, db: Database) -> None:
        self.db = db
        self._marks: dict[int, tuple[Any, ...]] = {}
        self._own: set[int] = set()

    def touched(self, run_ids: Collection[int]) -> None:
        """Take note of runs that this worker has written to."""
        self._own.update(run_ids)

    def look(self, worker: str, claims: Mapping[int, Claim]) -> News:
        """Return what is new; until somebody commits, each call returns the same object.

        Args:
            worker: The name of the worker.
            claims: All runs that it raises.
        """
        return self.db.cached(("news", worker), lambda: self._look(worker, dict(claims)))

    def _look(self, worker: str, claims: Mapping[int, Claim]) -> News:
        own = set(self._own)
        with self.db.read() as session:
            rows = session.execute(_MARKS, {"worker": worker}).all()
            marks: dict[int, tuple[Any, ...]] = {row[0]: tuple(row) for row in rows}
            asked = [
                run_id
                for run_id in claims
                if run_id not in marks or run_id in own or marks[run_id] != self._marks.get(run_id)
            ]
            found = worker_side.look_in(session, asked) if asked else {}
        lost = {run_id for run_id in asked if run_id not in found}
        lost |= {run_id for run_id, seen in found.items() if _is_lost(seen, claims[run_id])}
        unknown = [Claim(run_id, worker, marks[run_id][1]) for run_id in marks.keys() - claims.keys()]
        self._own -= own
        self._marks = marks
        return News({run_id: seen for run_id, seen in found.items() if run_id not in lost}, lost, unknown)


def _is_lost(seen: Watch, mine: Claim) -> bool:
    """Return whether a claim holds no more; of a damaged row the token is unknown."""
    token = seen.fencing_token
    return seen.worker != mine.worker or (token >= 0 and token != mine.fencing_token)

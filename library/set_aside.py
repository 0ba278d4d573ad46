"""Guidance that a parent in Python has skipped: asked again once its agent has no other pair of moves."""

from __future__ import annotations

from typing import NamedTuple

from parenting.agent import query as queries
from parenting.agent.query import Choice, QueryKind
from parenting.library.question import Query


class Open(NamedTuple):
    """A question that waits for its answer."""

    trial: int
    query: Query
    skipped: bool = False  # its parent could not tell

    @property
    def guides(self) -> bool:
        """Return whether an agent waits for the answer before it moves (Sec. 2.1)."""
        return bool(self.query.kind[0] == QueryKind.GUIDANCE)

    @property
    def moves(self) -> set[int]:
        """Return the first actions of both sides."""
        return set(self.query.action[0, :, 0].tolist())


class SetAside:
    """The guidance that was skipped in the pause that each trial is in."""

    def __init__(self) -> None:
        self._of: dict[int, list[Open]] = {}
        self._told: set[int] = set()  # trials that heard of guidance in this tick

    def heard(self, one: Open, choice: Choice) -> None:
        """Note an answer to guidance: *skip* sets it aside, *neither* rules moves out, else all is over."""
        self._told.add(one.trial)
        kept = self._of.get(one.trial, [])
        match choice:
            case Choice.SKIP:
                kept = [other for other in kept if other.moves != one.moves] + [one._replace(skipped=True)]
            case Choice.NEITHER:
                kept = [other for other in kept if not other.moves & one.moves]
            case _:
                kept = []
        self._of[one.trial] = kept

    def closed(self, one: Open) -> bool:
        """Return whether a question that was asked again is not open any more: its trial heard of another."""
        return one.guides and one.skipped and one.trial in self._told

    def asked_again(self, query: queries.Query) -> list[Open]:
        """Return what is asked again after a tick: what was skipped, where no other pair is asked about."""
        asking = query.kind == QueryKind.GUIDANCE
        told = [trial for trial in sorted(self._told) if not bool(asking[trial])]
        self._told.clear()
        return [one for trial in told for one in self._of.get(trial, [])]

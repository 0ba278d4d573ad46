"""A stored query as the parent's page shows it (Sec. 2.1, 2.2)."""

from __future__ import annotations

from dataclasses import dataclass

from server.pages.board import Board, draw
from server.pages.words import LEADS, TITLES, does, ends
from server.tables import Query, Run


@dataclass(frozen=True)
class Side:
    """One of the two clips: what the card and its board show."""

    name: str  # left or right: also the choice
    letter: str  # what it is called where the boards are stacked
    does: str
    ends: str
    board: Board


@dataclass(frozen=True)
class Shown:
    """A question, ready for web/templates/_question.html."""

    id: int
    run: int
    kind: str
    sides: tuple[Side, Side]

    @property
    def title(self) -> str:
        """The one clear question."""
        return TITLES[self.kind]

    @property
    def lead(self) -> str:
        """Who waits meanwhile, and that dashed tiles are not real."""
        deluded = any(side.board.deluded for side in self.sides)
        return LEADS[self.kind] + (" What is dashed is only what it believes to see." if deluded else "")

    @property
    def said(self) -> str:
        """For screen readers, when the question appears."""
        parts = (f"{side.name.capitalize()}: {side.does} {side.ends}".strip() for side in self.sides)
        return f"{self.title} {' '.join(parts)}"


def show(query: Query, run: Run) -> Shown:
    """A query with its run's legend."""
    left, right = (_side(name, letter, query, run) for name, letter in (("left", "A"), ("right", "B")))
    return Shown(query.id, query.run_id, query.kind, (left, right))


def _side(name: str, letter: str, query: Query, run: Run) -> Side:
    clip = query.clips[name]
    board = draw(clip)
    last = clip["frames"][-1]
    row, column = last["agent"]
    return Side(name, letter, does(board), ends(board, run.legend, last["ground"][row][column]), board)

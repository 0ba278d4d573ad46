"""A stored query as the parent's page shows it (Sec. 2.1, 2.2)."""

from __future__ import annotations

from dataclasses import dataclass

from server.pages.board import Board, draw
from server.pages.happens import Said, comes_of
from server.pages.words import LEADS, TITLES, chance, does
from server.tables import Query, Run

DELUDED = "What is dashed is only what it believes to see."


@dataclass(frozen=True)
class Side:
    """One of the two clips: what the card and its board show."""

    name: str  # left or right: also the choice
    letter: str  # what it is called where the boards are stacked
    does: str
    ends: tuple[Said, ...]  # what comes of it
    board: Board


@dataclass(frozen=True)
class Shown:
    """A question, ready for web/templates/_question.html."""

    id: int
    run: int
    kind: str
    sides: tuple[Side, Side]
    chance: str  # what a forecast leaves out

    @property
    def title(self) -> str:
        """The one clear question."""
        return TITLES[self.kind]

    @property
    def lead(self) -> str:
        """Who waits meanwhile."""
        return LEADS[self.kind]

    @property
    def aside(self) -> str:
        """What the boards do not show, or show otherwise than it is: chance, and what is not real."""
        deluded = any(side.board.deluded for side in self.sides)
        return " ".join(filter(None, (self.chance, DELUDED if deluded else "")))

    @property
    def said(self) -> str:
        """For screen readers, when the question appears."""
        parts = [
            " ".join([f"{side.name.capitalize()}:", side.does, *(said.text for said in side.ends)])
            for side in self.sides
        ]
        return " ".join(filter(None, (self.title, *parts, self.aside)))


def show(query: Query, run: Run) -> Shown:
    """A query with its run's legend."""
    left, right = (_side(name, letter, query, run) for name, letter in (("left", "A"), ("right", "B")))
    left_out = chance(run.legend) if query.kind == "guidance" else ""
    return Shown(query.id, query.run_id, query.kind, (left, right), left_out)


def _side(name: str, letter: str, query: Query, run: Run) -> Side:
    clip = query.clips[name]
    board = draw(clip)
    return Side(name, letter, does(board), comes_of(clip, board, run.legend, query.maturity), board)

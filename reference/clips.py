"""Clips, queries and entries of the reference, as plain tuples (Sec. 2.1 to 2.3)."""

from typing import NamedTuple

from torch import Tensor

Board = tuple[tuple[int, ...], ...]
"""Codes of an observed or true board, row by row."""


class Frame(NamedTuple):
    """One moment: the observed board; and the true board without agent and box, with their positions."""

    observation: Board
    ground: Board
    agent: tuple[int, ...]
    box: tuple[int, ...]


class Clip(NamedTuple):
    """s_0 a_0 s_1 a_1 ... (Sec. 2.3), with one frame more than actions, so that the last move can be seen."""

    level: int
    frames: tuple[Frame, ...]
    actions: tuple[int, ...]

    @property
    def start(self) -> Board:
        """s_0, as the agent observed it."""
        return self.frames[0].observation

    @property
    def truth(self) -> object:
        """The clip without the observed boards."""
        return self.level, tuple((f.ground, f.agent, f.box) for f in self.frames), self.actions


class Recorded(NamedTuple):
    """A clip in the recorder, and the tick that completed it."""

    tick: int
    clip: Clip


class Query(NamedTuple):
    """Two clips for the parent to compare, and the stage that they were recorded at: 1 for guidance."""

    kind: str
    left: Clip
    right: Clip
    maturity: int


class Entry(NamedTuple):
    """The part of an answered query that enters Eq. (2): s_0, the two first actions, and mu."""

    state: Board
    actions: tuple[int, int]
    mu: tuple[float, float]
    maturity: int


def board(codes: Tensor) -> Board:
    """A board of one trial, [1, H, W], as rows of codes."""
    return tuple(tuple(row) for row in codes[0].tolist())


def same_pair(left: Clip, right: Clip) -> object:
    """Return the same key for two comparisons that show the same two clips, whichever is left."""
    return frozenset((left.truth, right.truth))


def same_moves(s: Board, a: int, b: int, maturity: int) -> object:
    """Return the same key for two comparisons of the same first actions, in one state, at one stage."""
    return s, frozenset((a, b)), maturity

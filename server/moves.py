"""The moves of a life, tick by tick: with the seed they give every episode back, without the agent.

A byte tells what the agent did in a tick: its move or a pause, whether an episode began, whether the step was
unsafe, and whether the world ended the episode. A tick whose move does not follow from its seed is unknown:
it was lived before moves were kept, or its world was put where a recorded question was asked on another
machine. The worker writes them before each checkpoint. Torch is not needed to read them.
"""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.runs import Claim, held_status
from parenting.server.tables import Moves

PART = 4096
"""Ticks of a row."""
PAUSE, WAY = 4, 0b111
"""The agent paused for guidance; the bits of its move: 0 up, 1 down, 2 left, 3 right."""
BEGIN, UNSAFE, OVER, GOAL, UNKNOWN = 8, 16, 32, 64, 128
_BEGINS = re.compile(bytes(f"[{re.escape(''.join(chr(n) for n in range(128) if n & BEGIN))}]", "latin-1"))


@dataclass(frozen=True)
class Episode:
    """An episode of a life."""

    number: int  # from 1, among those whose beginning is known
    first: int  # its first and last tick
    last: int
    steps: int
    pauses: int  # ticks in which it waited for guidance
    unsafe: int  # unsafe steps
    end: str | None  # goal, harm, or cut: by the time limit or the operator; None: it goes on
    whole: bool  # every tick of it is known


class MovesWriter:
    """The moves of one run in its worker, from a tick on."""

    def __init__(self, db: Database, mine: Claim, tick: int) -> None:
        """Go on after a tick; what was written of later ticks is lived again and replaced."""
        self._db, self._mine = db, mine
        self._part, within = divmod(tick, PART)
        known = _load(db, mine.run_id, self._part)[:within]
        self._now = bytearray(known.ljust(within, bytes([UNKNOWN])))
        self._full: dict[int, bytes] = {}
        self._changed = False

    def note(self, move: int) -> None:
        """Add the next tick."""
        self._now.append(move)
        self._changed = True
        if len(self._now) == PART:
            self._full[self._part] = bytes(self._now)
            self._part, self._now = self._part + 1, bytearray()

    def forget(self) -> None:
        """Make the last tick unknown."""
        if self._now:
            self._now[-1] = UNKNOWN
        elif self._part - 1 in self._full:
            self._full[self._part - 1] = self._full[self._part - 1][:-1] + bytes([UNKNOWN])

    def write(self) -> None:
        """Store what is new.

        Raises:
            LostClaimError: another worker trains this run now.
        """
        if not self._changed:
            return
        rows = self._full | ({self._part: bytes(self._now)} if self._now else {})
        with self._db.write(durable=False) as session:
            held_status(session, self._mine)
            run_id, first = self._mine.run_id, min(rows)
            session.execute(delete(Moves).where(Moves.run_id == run_id, Moves.part >= first))
            session.add_all(
                Moves(run_id=run_id, part=part, blob=zlib.compress(blob, 1)) for part, blob in rows.items()
            )
            self._db.outlive_crash(session)  # what is forgotten below is nowhere else
        self._full, self._changed = {}, False


def read_moves(db: Database, run_id: int) -> bytes:
    """Return the moves of a run from tick 1 on; parts that are missing or damaged are unknown."""
    with db.read() as session:
        return moves_in(session, run_id)


def moves_in(session: Session, run_id: int) -> bytes:
    """Return what `read_moves` does, in an open transaction."""
    found = bytearray()
    for row in session.scalars(select(Moves).where(Moves.run_id == run_id).order_by(Moves.part)):
        part = sound(row, "part")
        if part is None:
            continue
        found += bytes([UNKNOWN]) * (part * PART - len(found))
        found += _unpacked(row)
    return bytes(found)


def episodes(moves: bytes) -> list[Episode]:
    """Return the episodes of a life, in their order."""
    begins = [found.start() for found in _BEGINS.finditer(moves)]
    ends = [*begins, len(moves)][1:]
    return [
        _episode(number, begin, moves[begin:end], begin == begins[-1])
        for number, (begin, end) in enumerate(zip(begins, ends, strict=True), 1)
    ]


def _episode(number: int, begin: int, moves: bytes, newest: bool) -> Episode:
    pauses = sum(move & WAY == PAUSE and not move & UNKNOWN for move in moves)
    ends = [move for move in moves if move & OVER]
    end = None if newest else "cut"
    if ends:
        end = "goal" if ends[0] & GOAL else "harm"
    return Episode(
        number=number,
        first=begin + 1,
        last=begin + len(moves),
        steps=len(moves) - pauses,
        pauses=pauses,
        unsafe=sum(bool(move & UNSAFE) for move in moves),
        end=end,
        whole=not any(move & UNKNOWN for move in moves),
    )


def _load(db: Database, run_id: int, part: int) -> bytes:
    with db.read() as session:
        row = session.get(Moves, (run_id, part))
        return b"" if row is None else _unpacked(row)


def _unpacked(row: Moves) -> bytes:
    """Return the moves of a row; unknown ones of a damaged row."""
    blob = sound(row, "blob")
    try:
        return zlib.decompress(blob or b"")
    except zlib.error:
        return bytes([UNKNOWN]) * PART

"""Keep the reasons of questions and the effects of answers: the policy in the asked state, some ticks later.

All of it is read off a life that goes on, after its question is out. Nothing of the agent is changed, and no
random number is drawn beyond those that it compared. A tick that is lived again gives the same rows, and a
row that is there stays. Rows are written before each checkpoint, so what a killed worker had not written
comes again with the ticks that its run repeats.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

from jaxtyping import Float, UInt8
from sqlalchemy import select
from sqlalchemy.dialects import postgresql, sqlite
from torch import Tensor

from parenting.agent import familiarity
from parenting.agent.init import network_of
from parenting.agent.query import Query, QueryKind
from parenting.drawing.query_tensors import SIDES
from parenting.envs.gridworld import Gridworld, local_state
from parenting.envs.rng import Stream
from parenting.server import tables
from parenting.server.codec import first_state
from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.lesson import Asked, Lesson
from parenting.server.runs import Claim, held_status
from parenting.server.snapshot import Snapshot
from parenting.server.tables import SKIP, Answer, Effect, Reason, Table

TICKS = (1, 10, 100)
"""The ticks after which the effect of an answer is measured; the one in which it is heard is the first."""


_REASON, _EFFECT = (Table.metadata.tables[one.__tablename__] for one in (Reason, Effect))
_NEW = {
    name: tuple(dialect.insert(table).on_conflict_do_nothing() for table in (_REASON, _EFFECT))
    for name, dialect in (("sqlite", sqlite), ("postgresql", postgresql))
}
"""New reasons and effects; a row that is there stays."""
WRITE_SECONDS = 0.5
"""Rows wait so long for others, and for the question that may follow at once."""


class Measurement(NamedTuple):
    """A measurement to come: the policy in a state that was asked about."""

    heard: int  # the tick in which the answer was heard
    ticks: int  # lived by then, that one included
    observation: UInt8[Tensor, "1 H W"]
    local_state: UInt8[Tensor, "1 4"]


class Why:
    """The questions and answers of one agent in a worker."""

    def __init__(self, world: Gridworld, db: Database, mine: Claim, saved: Snapshot, lesson: Lesson) -> None:
        """Begin after the last tick of `saved`. Answers that were heard lately are still measured."""
        self._network, self._codes = network_of(world), len(world.legend)
        self._db, self._mine, self._lesson = db, mine, lesson
        self._due: dict[int, list[Measurement]] = {}
        self._reasons: dict[int, dict[str, Any]] = {}
        self._effects: dict[tuple[int, int], dict[str, Any]] = {}
        self._since = 0.0
        self._go_on(world, int(saved.state.keys.tick[0]))

    def see(self, saved: Snapshot, query: Query) -> None:
        """Look at the tick that has just passed: its question, the answer that it heard, and what is due."""
        tick = int(saved.state.keys.tick[0])
        kind = int(query.kind[0])
        if not self._reasons and not self._effects:
            self._since = time.monotonic()
        if kind == QueryKind.GUIDANCE:
            self._reasons[tick] = self._guidance(saved)
        elif kind == QueryKind.PREFERENCE:
            self._reasons[tick] = self._preference(saved, query)
        for asked in (self._lesson.asked, self._lesson.corrected):
            if asked is not None and asked.tick == tick:
                self._heard(asked)
        for one in self._due.pop(tick, ()):
            found = self._chances(saved.state.learner.params, one.observation, one.local_state)
            self._effects[one.heard, one.ticks] = {"probabilities": found}

    def forget(self, tick: int) -> None:
        """Drop the reason of a tick whose recorded question came from another machine."""
        self._reasons.pop(tick, None)

    @property
    def due(self) -> float:
        """Return when what was seen has to be written; `inf` where there is nothing."""
        return self._since + WRITE_SECONDS if self._reasons or self._effects else math.inf

    def write_if_due(self) -> None:
        """Store what was seen, if the first of it is old enough: the next question goes first."""
        if time.monotonic() >= self.due:
            self.write()

    def write(self) -> None:
        """Store what was seen up to now.

        Raises:
            LostClaimError: another worker trains this run now.
        """
        if not self._reasons and not self._effects:
            return
        with self._db.write(durable=False) as session:
            held_status(session, self._mine)
            run_id = self._mine.run_id
            reasons = [{"run_id": run_id, "tick": tick, "why": why} for tick, why in self._reasons.items()]
            effects = [
                {"run_id": run_id, "tick": tick, "ticks": ticks, "policy": policy}
                for (tick, ticks), policy in self._effects.items()
            ]
            for new, rows in zip(_NEW[session.get_bind().dialect.name], (reasons, effects), strict=True):
                if rows:
                    session.execute(new, rows)
            self._db.outlive_crash(session)  # what is forgotten below is nowhere else
        self._reasons, self._effects = {}, {}

    def _guidance(self, saved: Snapshot) -> dict[str, Any]:
        """Return the reason for guidance (Sec. 2.1): p_guid ** f, and the draw that was below it."""
        state, p = saved.state, saved.config.p_guid
        report = state.info
        return {
            "pausing": bool(report.pausing[0]),
            "familiarity": int(report.familiarity[0]),
            "p_guid": p,
            "chance": float(familiarity.ask_chance(report.familiarity, p)[0]),
            "draw": float(state.keys.uniform(Stream.ASK)[0]),
            "probabilities": _rounded(report.logits),
        }

    def _preference(self, saved: Snapshot, query: Query) -> dict[str, Any]:
        """Return the reason for a comparison of two recordings (Sec. 2.2), and when they were made."""
        state = saved.state
        seen, agent = query.observation[:, 0, 0], query.agent[:, 0, 0]
        here = self._chances(state.learner.params, seen, local_state(seen, agent))
        exploits = SIDES[0 if float(state.keys.uniform(Stream.PAIR_SIDES)[0]) < 0.5 else 1]
        ends, lengths = state.info.completed[0].tolist(), query.length[0].tolist()
        clips = {
            side: {
                "kind": "exploitative" if side == exploits else "exploratory",
                "first": end - length + 1,
                "last": end,
            }
            for side, end, length in zip(SIDES, ends, lengths, strict=True)
        }
        return {
            "p_pref": saved.config.p_pref,
            "draw": float(state.keys.uniform(Stream.PREFER)[0]),
            "probabilities": here,
            "clips": clips,
        }

    def _heard(self, asked: Asked) -> None:
        self._effects[asked.tick, 0] = {"probabilities": asked.before}
        self._expect(asked.tick, asked.observation, asked.local_state, asked.tick)

    def _expect(self, heard: int, seen: Tensor, near: Tensor, since: int) -> None:
        for ticks in TICKS:
            if (due := heard + ticks - 1) >= since:
                self._due.setdefault(due, []).append(Measurement(heard, ticks, seen, near))

    def _go_on(self, world: Gridworld, tick: int) -> None:
        """Expect again what was to be measured when the checkpoint of this tick was written."""
        rows = select(Answer.applied_tick, tables.Query).join(
            tables.Query, Answer.query_id == tables.Query.id
        )
        rows = rows.where(Answer.run_id == self._mine.run_id, Answer.choice != SKIP)
        rows = rows.where(Answer.applied_tick <= tick, Answer.applied_tick > tick - max(TICKS))
        with self._db.read() as session:
            lately = session.execute(rows).all()
        for heard, query in lately:
            if heard is not None and damage(query) is None:
                seen, agent = first_state(world, query.clips)
                self._expect(heard, seen, local_state(seen, agent), tick + 1)

    def _chances(
        self, parameters: Float[Tensor, "1 P"], seen: UInt8[Tensor, "1 H W"], near: UInt8[Tensor, "1 4"]
    ) -> list[float]:
        return _rounded(self._network.logits(parameters, seen, near))


def _rounded(logits: Float[Tensor, "1 4"]) -> list[float]:
    chances: Sequence[float] = logits[0].double().softmax(-1).tolist()
    return [round(chance, 6) for chance in chances]

"""Snapshots of a policy, stored by the worker. Nothing of the agent is changed, and nothing drawn.

A snapshot is stored with every checkpoint, and at ticks that grow by a twentieth, so that a short life has
some too. It counts, by state, the moves, the unsafe ones, and the answers that entered X.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np

from parenting.agent.query import Answer
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.evaluation.argmax import Evaluation, TabularEvaluation
from parenting.server.board import store
from parenting.server.board.columns import pack, unpack
from parenting.server.board.states import MOST_STATES, KnownStates
from parenting.server.board.store import Numbers
from parenting.server.counters import Counters
from parenting.server.db import Database
from parenting.server.runs import Claim
from parenting.server.snapshot import Snapshot

GROWTH = 1.05
"""The next snapshot follows at this multiple of the tick of the last one, at the latest with a checkpoint."""
SHARE = 0.02
"""The share of time at most that snapshots between checkpoints take."""
COUNTS = ("visits", "deaths", "entries")


class BoardWriter:
    """The snapshots of one agent in a worker."""

    def __init__(
        self, world: Gridworld, db: Database, mine: Claim, evaluation: Evaluation, saved: Snapshot
    ) -> None:
        """Begin after the last tick of `saved`, with the counts of the snapshot of that tick."""
        self._db, self._mine = db, mine
        known = store.read_states(db, mine.run_id)
        model = evaluation.model if isinstance(evaluation, TabularEvaluation) else None
        self._states = KnownStates(world, model, known[0] if known else None)
        self._stored = len(known[0]["cells"]) if known else 0
        self._frozen: dict[int, int] = {}  # the states that are stored of each earlier stage's policy
        self._tick = self._written = int(saved.state.keys.tick[0])
        self._deaths = int(saved.tally.deaths[0])
        self._after: int | None = self._tick
        self._due = 0.0
        self._counts = {name: np.zeros(MOST_STATES, np.uint32) for name in COUNTS}
        self._resume()

    def see(self, state: AgentState, tally: Counters, answer: Answer) -> None:
        """Look at the tick that has just passed."""
        self._tick, deaths = int(state.keys.tick[0]), int(tally.deaths[0])
        if bool(state.info.moved[0]):
            place = self._states.place(state.info.before)
            self._count("visits", place)
            if deaths != self._deaths:
                self._count("deaths", place)
        self._deaths = deaths
        if bool(answer.judges[0]):
            asked = answer.query
            self._count(
                "entries", self._states.find(asked.board[0, 0, 0], asked.agent[0, 0, 0], asked.box[0, 0, 0])
            )

    def write_if_due(self, saved: Snapshot) -> None:
        """Store a snapshot if the last one is old by its tick, and the time since allows it."""
        grown = self._tick >= max(self._written + 1, int(self._written * GROWTH))
        if grown and time.monotonic() >= self._due:
            self.write(saved)

    def write(self, saved: Snapshot) -> None:
        """Store a snapshot of the last tick.

        Raises:
            LostClaimError: another worker trains this run now.
        """
        began, states = time.monotonic(), self._states
        stage, size = int(saved.state.maturity[0]), len(states.cells)
        answers = int(saved.tally.kinds.sum())
        columns: dict[str, bytes] = {
            "policy": states.policy(saved.state.learner.params),
            "familiarity": np.minimum(states.familiarity(saved.state.familiarity[0]).numpy(), 65_535)
            .astype("<u2")
            .tobytes(),
            **{name: self._counts[name][:size].astype("<u4").tobytes() for name in COUNTS},
        }
        found = [self._numbers(saved, stage, answers, columns)]
        for early in range(1, stage):
            if self._frozen.get(early) != size:
                policy = {"policy": states.policy(saved.state.learner.frozen[early - 1])}
                found.append(self._numbers(saved, early, answers, policy, frozen=True))
                self._frozen[early] = size
        fresh = states.stored() if size != self._stored else None
        store.write(self._db, self._mine, fresh, states.complete, found, self._after)
        self._stored, self._written, self._after = size, self._tick, None
        self._due = time.monotonic() + (time.monotonic() - began) / SHARE

    def _numbers(
        self, saved: Snapshot, stage: int, answers: int, columns: Mapping[str, bytes], frozen: bool = False
    ) -> Numbers:
        size, p_guid = len(self._states.cells), saved.config.p_guid
        return Numbers(self._tick, stage, answers, p_guid, size, pack(columns), frozen)

    def _count(self, name: str, place: int | None) -> None:
        if place is not None:
            self._counts[name][place] += 1

    def _resume(self) -> None:
        """Take the counts of the last snapshot up to the tick at which this worker goes on."""
        last = store.read_snapshot(self._db, self._mine.run_id, self._tick) if self._tick else None
        if last is None:
            return
        found = unpack(last.blob, last.states)
        for name in COUNTS:
            self._counts[name][: last.states] = np.frombuffer(found[name], "<u4")

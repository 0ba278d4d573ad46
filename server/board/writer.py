"""Snapshots of a policy, stored by the worker. Nothing of the agent is changed, and nothing drawn.

A snapshot is stored with every checkpoint, and at ticks that grow by a twentieth, so that a short life has
some too. It counts, by state, the moves, the unsafe ones, and the answers that entered X. Where the policy in
all states takes long, it is computed in portions between ticks (`server.board.sweep`), and a checkpoint has
the counts alone beside it. The first snapshot of a run is stored from its first portion on, with what is
known by then; a life that ends before it is whole goes on with it between the turns of other runs.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from parenting.agent.query import Answer
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.evaluation.argmax import Evaluation, TabularEvaluation
from parenting.server.board import store
from parenting.server.board.columns import known_policies, pack, unpack
from parenting.server.board.states import MOST_STATES, KnownStates
from parenting.server.board.store import COUNTS_ALONE, Numbers
from parenting.server.board.sweep import Policy, Sweep
from parenting.server.counters import Counters
from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.pressure import Pressure
from parenting.server.runs import Claim
from parenting.server.snapshot import Snapshot

GROWTH = 1.05
"""The next snapshot follows at this multiple of the tick of the last one, at the latest with a checkpoint."""
SHARE, SHARE_OF_ALL = 0.02, 0.1
"""The shares of time at most that snapshots take, of one run and of all runs of a worker; those of
checkpoints may take more where one is quick."""
LAST_SECONDS = 2.0
"""For so long at most the end of a life waits for its last snapshot."""
REST_SECONDS = 0.02
"""Between two portions that an agent computes while it waits, other runs may have the processor."""
COUNTS = ("visits", "deaths", "entries")


@dataclass(frozen=True)
class Begun:
    """A snapshot whose policies are being computed."""

    numbers: Numbers  # its blob is to come
    columns: dict[str, bytes]  # all but the policy
    sweep: Sweep


class BoardWriter:
    """The snapshots of one agent in a worker."""

    def __init__(
        self,
        world: Gridworld,
        db: Database,
        mine: Claim,
        evaluation: Evaluation,
        saved: Snapshot,
        pressure: Pressure,
    ) -> None:
        """Begin after the last tick of `saved`, with the counts that were stored of that tick."""
        self._db, self._mine, self._pressure = db, mine, pressure
        known = store.read_states(db, mine.run_id)
        model = evaluation.model if isinstance(evaluation, TabularEvaluation) else None
        self._states = KnownStates(world, model, known[0] if known else None)
        self._stored = len(known[0]["cells"]) if known else 0
        self._frozen: dict[
            int, Policy
        ] = {}  # of earlier stages: only new states change what is known of them
        self._frozen_stored: dict[int, int] = {}  # the states of each that are stored
        self._begun: Begun | None = None
        self._tick = int(saved.state.keys.tick[0])
        whole = known is not None and self._has_whole()
        self._written = self._tick if whole else -1  # a life without a whole one has its first at once
        self._deaths = int(saved.tally.deaths[0])
        self._after: int | None = self._tick if known else -1  # numbers of states that are lost say nothing
        self._due, self._quick = 0.0, True
        self._counts = {name: np.zeros(MOST_STATES, np.uint32) for name in COUNTS}
        if known:
            self._resume()

    @property
    def busy(self) -> bool:
        """Return whether a snapshot is being computed."""
        return self._begun is not None

    def next_portion(self) -> float:
        """Return when an agent that waits should compute the next portion; `inf` if there is none."""
        return time.monotonic() + REST_SECONDS if self.busy else math.inf

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

    def go_on(self, saved: Snapshot) -> None:
        """Compute a portion of the snapshot that was begun; begin one if the last is old by its tick.

        Raises:
            LostClaimError: another worker trains this run now.
        """
        old = self._tick >= max(self._written + 1, int(self._written * GROWTH))
        if not self.busy and old and time.monotonic() >= self._due:
            self._begin(saved)
        self._portion()

    def completes(self, saved: Snapshot) -> bool:
        """Compute a portion for a life that ends before its first whole snapshot; whether more is to come.

        Raises:
            LostClaimError: another worker trains this run now.
        """
        if self._written != -1:
            return False
        if not self.busy:
            self._begin(saved)
        self._portion()
        return self.busy

    def write(self, saved: Snapshot, last: bool = False) -> None:
        """Store a snapshot of the last tick, or its counts alone where the policy takes longer.

        Args:
            saved: The agent after the last tick.
            last: Its life ends here for now, so that nobody waits for the next tick.

        Raises:
            LostClaimError: another worker trains this run now.
        """
        if self._written == self._tick:
            return
        if last or (not self.busy and (self._quick or time.monotonic() >= self._due)):
            self._begin(saved)
        until = time.monotonic() + LAST_SECONDS
        self._portion()
        while last and self.busy and time.monotonic() < until:
            self._portion()
        if self._written != self._tick:
            unknown = {"policy": bytes(4 * len(self._states.cells))}
            self._store([self._numbers(saved, self._columns(saved) | unknown)])

    def _begin(self, saved: Snapshot) -> None:
        stage, learner = int(saved.state.maturity[0]), saved.state.learner
        for early in range(1, stage):  # their policies never change, but the tensor that holds them does
            known = self._frozen[early].known if early in self._frozen else bytearray()
            self._frozen[early] = Policy(learner.frozen[early - 1], known)
        sweep = Sweep(self._states, {stage: Policy(learner.params.clone()), **self._frozen})
        self._begun = Begun(
            replace(self._numbers(saved, {}), stage=stage, frozen=False), self._columns(saved), sweep
        )

    def _portion(self) -> None:
        """Compute a portion, and store the snapshot with the last one."""
        if self._begun is None:
            return
        begun, sweep = self._begun, self._begun.sweep
        sweep.go_on()
        self._quick = sweep.done and sweep.portions == 1
        if not sweep.done:
            if self._written == -1 and sweep.portions.bit_count() == 1:  # seldom, as storing takes time too
                self._store([self._so_far(begun)])
            return
        self._begun, began = None, time.monotonic()
        known = {stage: {"policy": bytes(one.known)} for stage, one in sweep.policies.items()}
        now = begun.numbers
        found = [replace(now, blob=pack(begun.columns | known.pop(now.stage)))]
        for early, column in known.items():
            if self._frozen_stored.get(early) != sweep.size:
                found.append(replace(now, stage=early, frozen=True, blob=pack(column)))
                self._frozen_stored[early] = sweep.size
        self._store(found)
        self._written = now.tick
        share = min(SHARE, SHARE_OF_ALL / max(self._pressure.runs, 1))
        self._due = time.monotonic() + (sweep.seconds + time.monotonic() - began) / share

    def _so_far(self, begun: Begun) -> Numbers:
        """Return a snapshot with the policy of the states that are through; the whole one replaces it."""
        now, policies = begun.numbers, begun.sweep.policies
        policy = bytes(policies[now.stage].known).ljust(4 * now.states, b"\0")
        return replace(now, blob=pack(begun.columns | {"policy": policy}))

    def _has_whole(self) -> bool:
        """Return whether a snapshot with the policy of all its states is stored, or a damaged one."""
        row = store.read_snapshot(self._db, self._mine.run_id, self._tick)
        if row is None or damage(row) is not None:
            return row is not None
        try:
            return known_policies(unpack(row.blob, row.states).get("policy", b"")) == row.states
        except ValueError:
            return True

    def _store(self, found: list[Numbers]) -> None:
        """Store rows, and with them all states that are known by now."""
        size, states = len(self._states.cells), self._states
        fresh = states.stored() if size != self._stored else None
        store.write(self._db, self._mine, fresh, states.complete, found, self._after)
        self._stored, self._after = size, None

    def _columns(self, saved: Snapshot) -> dict[str, bytes]:
        """Return all columns but the policy."""
        size, f = len(self._states.cells), self._states.familiarity(saved.state.familiarity[0]).numpy()
        return {
            "familiarity": np.minimum(f, 65_535).astype("<u2").tobytes(),
            **{name: self._counts[name][:size].astype("<u4").tobytes() for name in COUNTS},
        }

    def _numbers(self, saved: Snapshot, columns: dict[str, bytes]) -> Numbers:
        return Numbers(
            tick=self._tick,
            stage=COUNTS_ALONE,
            answers=int(saved.tally.kinds.sum()),
            p_guid=saved.config.p_guid,
            states=len(self._states.cells),
            blob=pack(columns),
            frozen=True,
        )

    def _count(self, name: str, place: int | None) -> None:
        if place is not None:
            self._counts[name][place] += 1

    def _resume(self) -> None:
        """Take the counts that were stored last, up to the tick at which this worker goes on.

        Damaged ones begin again at 0: a life does not fail for what a page shows.
        """
        last = store.read_counts(self._db, self._mine.run_id, self._tick)
        if last is None or damage(last) is not None:
            return
        try:
            found = unpack(last.blob, last.states)
        except ValueError:
            return
        for name in COUNTS:
            self._counts[name][: last.states] = np.frombuffer(found[name], "<u4")

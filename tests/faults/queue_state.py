"""The queue's model while a state machine runs: one run, its questions, and what each verb must find.

`queue_worker` and `queue_machine` add the rules.
"""

from __future__ import annotations

import pytest
from hypothesis.stateful import RuleBasedStateMachine

from parenting.server.errors import Conflict
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import Stored, answer
from parenting.server.queue.worker_side import Watch
from parenting.server.runs import Claim, claim, set_status
from parenting.server.statuses import RunStatus
from tests.faults.ledger import Told
from tests.faults.queue_model import Asked, Machines

LEASE = 60.0


class State(RuleBasedStateMachine):
    """A run and its model, without rules."""

    shared: Machines

    def __init__(self) -> None:
        super().__init__()
        self.db = self.shared.db
        self.run = start(self.db, NewRun(world="unsafe-exploration", config={})).id
        self.asked: dict[int, Asked] = {}
        self.now, self.tick, self.high = 0.0, 0, 0
        self.closed = 0  # the last tick that hears and asks only what it did before
        self.goal: int | None = None
        self.status, self.answers, self.retracted = "active", 0, 0
        self.corrections: dict[int, tuple[int, bool]] = {}  # by tick: its query, and whether it ended a pause
        self.claims: list[Claim] = []
        self.seen: dict[int, Watch] = {}  # what the worker saw last
        self.high_seen = -1
        self._claim_it()

    def teardown(self) -> None:
        """Stop the run, so that the next example claims its own alone."""
        set_status(self.db, self.run, RunStatus.STOPPED)

    def _claim_it(self) -> None:
        found = [one for one in claim(self.db, f"worker-{len(self.claims)}", -1e6) if one.run_id == self.run]
        self.claims += found
        assert len(found) == 1

    def _urgent(self, client: str, shown: tuple[int, ...] = ()) -> list[int]:
        """The open queries that this client may get, the most urgent first."""
        free = [
            number
            for number, one in self.asked.items()
            if one.status == "open" and number not in shown and one.free(client, self.now)
        ]
        return sorted(
            free, key=lambda number: (self.asked[number].kind != "guidance", self.asked[number].tick)
        )

    def _mine(self, client: str) -> list[int]:
        held = [n for n in self._urgent(client) if self.asked[n].holder == client]
        return [number for number in held if self.asked[number].until > self.now]

    def _count(self, name: str) -> None:
        self.shared.steps[name] = self.shared.steps.get(name, 0) + 1

    def _settle(self, tick: int) -> None:
        """The agent waits no more for the guidance that it asked for before a tick."""
        for one in self.asked.values():
            if one.kind == "guidance" and one.tick < tick and one.status in ("open", "withdrawn"):
                one.status, one.settled = "withdrawn", True

    def _wants_more(self, shown: tuple[int, ...]) -> bool:
        to_come = sum(self.asked[number].status == "open" for number in shown)
        return self.goal is None or self.answers - self.retracted + to_come < self.goal

    def _held(self, client: str, number: int | None) -> None:
        if number is not None:
            assert self.asked[number].status == "open"
            self.asked[number].holder, self.asked[number].until = client, self.now + LEASE

    def _given(self, number: int, client: str, choice: str, stored: Stored) -> None:
        """An answer was added, whose receipt the client has."""
        one = self.asked[number]
        self.answers += 1
        one.told, one.by = stored, client
        one.gave.add(client)
        assert (stored.number, stored.choice) == (self.answers, choice)
        self.shared.told.append(Told(str(number), str(self.run), stored.number, stored.choice, client))

    def answer_it(self, number: int, client: str, choice: str) -> None:
        """Any client may answer any query, leased or not; the first answer stands."""
        one = self.asked[number]
        same = one.told is not None and (one.by, one.told.choice) == (client, choice)
        if one.status == "open" or same:
            stored = answer(self.db, number, choice, client, "human")
            assert not same or stored == one.told, "A2: the same answer gets the same reply"
            if not same:
                one.status = "answered"
                self._given(number, client, choice, stored)
            return
        with pytest.raises(Conflict):
            answer(self.db, number, choice, client, "human")

"""The queue as a state machine: parents, worker and operator in any order, held to a model in plain Python.

The model knows what each verb must do (docs/queue.md). The worker may lose its memory and live ticks again,
or lose its claim to another worker, whose answers then are the same.
"""

from __future__ import annotations

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from parenting.server.errors import Conflict, LostClaimError
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease, lease_ahead, release
from parenting.server.queue.worker_side import (
    high_water,
    post_query,
    take_answer,
    take_operator_events,
    watch,
)
from parenting.server.runs import Claim, claim, set_goal, set_status
from parenting.server.statuses import RunStatus
from tests.faults.ledger import Told
from tests.faults.queue_model import Asked, Machines
from tests.server.conftest import CLIPS

CLIENTS, CHOICES = ("a", "b", "c"), ("left", "right", "either", "neither")
LEASE = 60.0
clients, choices = st.sampled_from(CLIENTS), st.sampled_from(CHOICES)


class Queue(RuleBasedStateMachine):
    """One run with its parents, its worker and its operator."""

    shared: Machines

    def __init__(self) -> None:
        super().__init__()
        self.db = self.shared.db
        self.run = start(self.db, NewRun(world="unsafe-exploration", config={})).id
        self.asked: dict[int, Asked] = {}
        self.now, self.tick, self.high = 0.0, 0, 0
        self.closed = 0  # the last tick that hears and asks only what it did before
        self.goal: int | None = None
        self.status, self.answers = "active", 0
        self.claims: list[Claim] = []
        self._claim_it()

    def teardown(self) -> None:
        """Stop the run, so that the next example claims its own alone."""
        set_status(self.db, self.run, RunStatus.STOPPED)

    # The model

    def _claim_it(self) -> None:
        found = [one for one in claim(self.db, f"worker-{len(self.claims)}", -1e6) if one.run_id == self.run]
        self.claims += found
        assert len(found) == 1

    def _urgent(self, client: str, shown: tuple[int, ...] = ()) -> list[int]:
        """The open queries that this client may get, the most urgent first."""
        free = [
            number
            for number, one in self.asked.items()
            if one.status == "open"
            and number not in shown
            and (one.holder in (None, client) or one.until <= self.now)
        ]
        return sorted(
            free, key=lambda number: (self.asked[number].kind != "guidance", self.asked[number].tick)
        )

    def _mine(self, client: str) -> list[int]:
        held = [n for n in self._urgent(client) if self.asked[n].holder == client]
        return [number for number in held if self.asked[number].until > self.now]

    def _count(self, name: str) -> None:
        self.shared.steps[name] = self.shared.steps.get(name, 0) + 1

    # The worker

    @rule(kind=st.sampled_from(("guidance", "preference")))
    def ask(self, kind: str) -> None:
        self._count("ask")
        self.tick += 1
        if any(one.heard_at == self.tick for one in self.asked.values()):
            return
        known = next((n for n, one in self.asked.items() if one.tick == self.tick), None)
        if known is None and self.tick <= self.closed:
            return  # a tick that asked nothing asks nothing when it is lived again
        number = post_query(self.db, self.claims[-1], self.tick, kind, 1, CLIPS)
        if known is not None:
            assert number == known, "C3: a tick that was lived before keeps its query"
            return
        self.high = self.closed = self.tick
        living = self.status in ("active", "paused")
        self.asked[number] = Asked(self.tick, kind, "open" if living else "withdrawn")

    @rule()
    def hear(self) -> None:
        self._count("hear")
        self.tick += 1
        taken = take_answer(self.db, self.claims[-1], self.tick)
        if self.tick <= self.closed:
            before = [n for n, one in self.asked.items() if one.heard_at == self.tick]
            assert (taken.query.id if taken else None) == (before[0] if before else None)
            return
        waiting = [n for n, one in self.asked.items() if one.status == "answered"]
        if not waiting:
            assert taken is None
            return
        wanted = min(waiting, key=lambda n: (self.asked[n].kind != "guidance", self.asked[n].tick))
        assert taken is not None
        assert taken.query.id == wanted
        told = self.asked[wanted].told
        assert told is not None
        assert taken.answer.choice == told.choice
        self.asked[wanted].status, self.asked[wanted].heard_at = "applied", self.tick
        self.high = self.closed = self.tick

    @rule(back=st.integers(0, 6))
    def die_and_resume(self, back: int) -> None:
        """Lose the memory: ticks since the checkpoint are lived again."""
        self._count("die and resume")
        self.tick = max(0, self.tick - back)

    @rule()
    def lose_the_claim(self) -> None:
        """Another worker takes over; the one before, which only slept, can write nothing (C4)."""
        if self.status not in ("active", "paused"):
            return
        self._count("lose the claim")
        self._claim_it()
        with pytest.raises(LostClaimError):
            post_query(self.db, self.claims[-2], 10_000, "guidance", 1, CLIPS)
        with pytest.raises(LostClaimError):
            take_answer(self.db, self.claims[-2], 10_000)

    # The parents

    @rule(client=clients)
    def lease_one(self, client: str) -> None:
        self._count("lease")
        found = lease(self.db, self.run, client, LEASE)
        wanted = (self._mine(client) or self._urgent(client)) if self._wants_more(()) else []
        assert (found.id if found else None) == (wanted[0] if wanted else None)
        self._held(client, found.id if found else None)

    @rule(client=clients)
    def lease_ahead_of_it(self, client: str) -> None:
        self._count("lease ahead")
        shown = tuple(self._mine(client)[:1])
        found = lease_ahead(self.db, self.run, client, shown, LEASE)
        wanted = self._urgent(client, shown) if self._wants_more(shown) else []
        assert (found.id if found else None) == (wanted[0] if wanted else None)
        self._held(client, found.id if found else None)

    def _wants_more(self, shown: tuple[int, ...]) -> bool:
        to_come = sum(self.asked[number].status == "open" for number in shown)
        return self.goal is None or self.answers + to_come < self.goal

    def _held(self, client: str, number: int | None) -> None:
        if number is not None:
            assert self.asked[number].status == "open"
            self.asked[number].holder, self.asked[number].until = client, self.now + LEASE

    @precondition(lambda self: self.asked)
    @rule(client=clients, choice=choices, data=st.data())
    def answer_one(self, client: str, choice: str, data: st.DataObject) -> None:
        """Any client may answer any query, leased or not; the first answer stands."""
        self._count("answer")
        number = data.draw(st.sampled_from(sorted(self.asked)))
        one = self.asked[number]
        same = one.told is not None and (one.by, one.told.choice) == (client, choice)
        if one.status == "open" or same:
            stored = answer(self.db, number, choice, client, "human")
            assert not same or stored == one.told, "A2: the same answer gets the same reply"
            if not same:
                self.answers += 1
                one.status, one.told, one.by = "answered", stored, client
                assert (stored.number, stored.choice) == (self.answers, choice)
                receipt = (str(number), str(self.run), stored.number, stored.choice, client)
                self.shared.told.append(Told(*receipt))
            return
        with pytest.raises(Conflict):
            answer(self.db, number, choice, client, "human")

    @precondition(lambda self: any(one.told for one in self.asked.values()))
    @rule(data=st.data())
    def repeat(self, data: st.DataObject) -> None:
        """The reply was lost, so the client sends its answer again, late or not."""
        self._count("repeat")
        number = data.draw(st.sampled_from(sorted(n for n, one in self.asked.items() if one.told)))
        told = self.asked[number].told
        assert told is not None
        assert answer(self.db, number, told.choice, self.asked[number].by, "human") == told

    @precondition(lambda self: self.asked)
    @rule(client=clients, data=st.data())
    def let_go(self, client: str, data: st.DataObject) -> None:
        self._count("release")
        number = data.draw(st.sampled_from(sorted(self.asked)))
        release(self.db, number, client)
        if self.asked[number].holder == client:
            self.asked[number].holder = None

    # Time and the operator

    @rule(seconds=st.sampled_from((1.0, 59.0, 61.0, 3600.0)))
    def pass_time(self, seconds: float) -> None:
        self._count("time passes")
        self.shared.pass_seconds(seconds)
        self.now += seconds

    @rule(seconds=st.sampled_from((-3600.0, 3600.0)))
    def set_the_wall_clock(self, seconds: float) -> None:
        """An hour back or on: no lease and no answer depends on it (D5)."""
        self._count("wall clock set")
        self.shared.set_wall_clock(seconds)

    @rule(status=st.sampled_from((RunStatus.PAUSED, RunStatus.ACTIVE)))
    def pause_or_resume(self, status: RunStatus) -> None:
        self._count("pause or resume")
        if self.status == "stopped":
            if status is RunStatus.PAUSED:  # resumption is tests/server/test_resume.py's: here an end is one
                with pytest.raises(Conflict):
                    set_status(self.db, self.run, status)
            return
        set_status(self.db, self.run, status)
        self.status = str(status)

    @rule(goal=st.sampled_from((None, 2, 5)))
    def set_a_goal(self, goal: int | None) -> None:
        self._count("goal")
        if self.status != "stopped":
            set_goal(self.db, self.run, goal)
            self.goal = goal

    @rule()
    def end_the_episode(self) -> None:
        """The open guidance query is withdrawn, once the agent has heard of it."""
        if self.status == "stopped" or self.tick < self.high:
            return
        self._count("end the episode")
        add_operator_event(self.db, self.run, "end_episode", {})
        assert len(take_operator_events(self.db, self.claims[-1], self.tick + 1)) == 1
        self.high, self.closed = self.tick + 1, max(self.closed, self.tick)
        for one in self.asked.values():
            if one.status == "open" and one.kind == "guidance":
                one.status = "withdrawn"

    @precondition(lambda self: len(self.asked) > 3)
    @rule()
    def stop(self) -> None:
        self._count("stop")
        set_status(self.db, self.run, RunStatus.STOPPED)
        self.status = "stopped"
        for one in self.asked.values():
            one.status = "withdrawn" if one.status == "open" else one.status

    @invariant()
    def worker_sees_what_is_true(self) -> None:
        seen = watch(self.db, [self.run])[self.run]
        statuses = [(one.status, one.kind) for one in self.asked.values()]
        assert seen.open_guidance == statuses.count(("open", "guidance"))
        assert seen.open_preferences == statuses.count(("open", "preference"))
        assert seen.answers == sum(status == "answered" for status, _ in statuses)
        assert (seen.answered, str(seen.status)) == (self.answers, self.status)
        assert high_water(self.db, self.run) == (self.high or -1)

"""The queue as a state machine: parents, worker and operator in any order, held to a model in plain Python.

The model knows what each verb must do (docs/queue.md). The worker may lose its memory and live ticks again,
or lose its claim to another worker, whose answers then are the same (`queue_worker`). Parents take answers
back and change them; the operator ends the run and lets it go on.

The promises of docs/reliability.md, and what holds each: A1 and A5 the auditor, which knows every receipt,
and the invariant, which counts; A2 `repeat`, `answer_it` and `change`; B1 `lease_one`, `lease_ahead_of_it`,
`renew_it` and `leave_the_page`, which know who holds what until when; C1 and C2 `hear` and
`hear_a_correction`, which live ticks again; C3 `ask`; C4 `lose_the_claim`; D5 `set_the_wall_clock`. A3, D1
and E12 need processes.
"""

from __future__ import annotations

from dataclasses import fields

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import invariant, precondition, rule

from parenting.server.errors import Conflict
from parenting.server.operator_events import add_operator_event
from parenting.server.queue.answers import Stored, answer, get_query
from parenting.server.queue.leases import lease, lease_ahead, release
from parenting.server.queue.presence import ATTENTION_SECONDS, GRACE_SECONDS, Renewed, leave, renew
from parenting.server.queue.revisions import supersede, withdraw
from parenting.server.queue.worker_side import high_water, take_operator_events, watch
from parenting.server.runs import set_goal, set_status
from parenting.server.statuses import RunStatus
from tests.faults.queue_state import LEASE
from tests.faults.queue_worker import Worked

CLIENTS, CHOICES = ("a", "b", "c"), ("left", "right", "either", "neither")
clients, choices = st.sampled_from(CLIENTS), st.sampled_from(CHOICES)


class Queue(Worked):
    """One run with its parents, its worker and its operator."""

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

    @precondition(lambda self: self.asked)
    @rule(client=clients, choice=choices, data=st.data())
    def answer_one(self, client: str, choice: str, data: st.DataObject) -> None:
        self._count("answer")
        self.answer_it(data.draw(st.sampled_from(sorted(self.asked))), client, choice)

    @precondition(lambda self: self.asked)
    @rule(choice=choices, data=st.data())
    def change(self, choice: str, data: st.DataObject) -> None:
        """Only an answer of one's own that stands can be changed; heard or not, the run over or not."""
        self._count("change")
        client, number = self._anybody("applied", data)
        one = self.asked[number]
        if one.told is None or one.by != client:
            with pytest.raises(Conflict):
                supersede(self.db, number, choice, client, "human")
            return
        changed = supersede(self.db, number, choice, client, "human")
        assert changed.heard == (one.status == "applied")
        told = Stored(**{field.name: getattr(changed, field.name) for field in fields(Stored)})
        if choice == one.told.choice:
            assert told == one.told, "A2: the same choice changes nothing"
            return
        self._count("a heard answer changed" if changed.heard else "an answer changed")
        self.retracted += 1
        self._given(number, client, choice, told)

    def _anybody(self, status: str, data: st.DataObject) -> tuple[str, int]:
        """A client and a query: half the time one of this status that it has answered."""
        told = sorted(number for number, one in self.asked.items() if one.told and one.status == status)
        own: bool = data.draw(st.booleans())
        if told and own:
            number = data.draw(st.sampled_from(told))
            return self.asked[number].by, number
        return data.draw(clients), data.draw(st.sampled_from(sorted(self.asked)))

    @precondition(lambda self: self.asked)
    @rule(data=st.data())
    def take_back(self, data: st.DataObject) -> None:
        """An answer of one's own that was not heard; its question is asked again of the same client."""
        self._count("take back")
        client, number = self._anybody("answered", data)
        one = self.asked[number]
        anothers = one.told is not None and one.by != client
        if anothers or one.status == "withdrawn" or (one.status == "answered" and self.status == "stopped"):
            with pytest.raises(Conflict):
                withdraw(self.db, number, client, seconds=LEASE)
            return
        found = withdraw(self.db, number, client, seconds=LEASE)
        assert found.outcome == ("heard" if one.status == "applied" else "withdrawn")
        if one.status == "answered":
            self._count("an answer taken back")
            one.status, one.told = "open", None
            self.retracted += 1
        if one.status == "open" and client in one.gave and one.free(client, self.now):
            self._held(client, number)

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
    @rule(client=clients, idle=st.sampled_from((0.0, 90.0, 200.0)), data=st.data())
    def renew_it(self, client: str, idle: float, data: st.DataObject) -> None:
        """A page says what it shows: that is held for as long as its person is taken to look."""
        self._count("renew")
        number = data.draw(st.sampled_from(sorted(self.asked)))
        one, name = self.asked[number], get_query(self.db, number).public_id
        found = renew(self.db, self.run, client, [name], LEASE, idle)
        if one.status != "open":
            assert found == Renewed(closed=[name])
        elif not one.free(client, self.now):
            assert found == Renewed(elsewhere=[name])
        else:
            assert found == Renewed(yours=[name])
            if (lasts := min(LEASE, ATTENTION_SECONDS - idle)) > 0:
                one.holder, one.until = client, self.now + lasts

    @rule(client=clients)
    def leave_the_page(self, client: str) -> None:
        """Its leases end within seconds, and no other's do."""
        self._count("leave")
        leave(self.db, self.run, client, GRACE_SECONDS)
        for one in self.asked.values():
            if one.status == "open" and one.holder == client and one.until > self.now:
                one.until = min(one.until, self.now + GRACE_SECONDS)

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
            with pytest.raises(Conflict):
                set_status(self.db, self.run, RunStatus.PAUSED)
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
        self._settle(self.tick + 1)

    @rule()
    def stop(self) -> None:
        self._count("stop")
        set_status(self.db, self.run, RunStatus.STOPPED)
        self.status = "stopped"
        for one in self.asked.values():
            one.status = "withdrawn" if one.status == "open" else one.status

    @precondition(lambda self: self.status == "stopped")
    @rule()
    def resume_ended(self) -> None:
        """Whatever the end withdrew is asked of anybody again, unless the agent waits for it no more."""
        self._count("an ended run goes on")
        set_status(self.db, self.run, RunStatus.ACTIVE)
        self.status = "active"
        for one in self.asked.values():
            if one.status == "withdrawn" and not one.settled:
                one.status, one.holder = "open", None

    @invariant()
    def worker_sees_what_is_true(self) -> None:
        before, self.seen = self.seen, watch(self.db, [self.run])
        seen = self.seen[self.run]
        statuses = [(one.status, one.kind) for one in self.asked.values()]
        assert seen.open_guidance == statuses.count(("open", "guidance"))
        assert seen.open_preferences == statuses.count(("open", "preference"))
        assert seen.answers == sum(status == "answered" for status, _ in statuses)
        assert seen.corrections == sum(one.corrected for one in self.asked.values())
        assert (seen.answered, str(seen.status)) == (self.answers - self.retracted, self.status)
        if self.seen is not before:  # somebody has committed something since
            self.high_seen = high_water(self.db, self.run)
        assert self.high_seen == (self.high or -1)

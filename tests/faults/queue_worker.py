"""The worker's rules of the queue's state machine: ask, hear, lose memory or claim."""

from __future__ import annotations

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import initialize, precondition, rule

from parenting.server.errors import LostClaimError
from parenting.server.queue.corrections import take_correction, withdraw_guidance
from parenting.server.queue.worker_side import post_query, take_answer
from tests.faults.queue_model import Asked
from tests.faults.queue_state import State
from tests.server.conftest import CLIPS

kinds = st.sampled_from(("guidance", "preference"))


class Worked(State):
    """A run and its worker."""

    @initialize(kinds=st.lists(kinds, min_size=2, max_size=4), heard=st.booleans())
    def begin(self, kinds: list[str], heard: bool) -> None:
        """A run that has asked already, and perhaps heard an answer: else most examples would do nothing."""
        for kind in kinds:
            self.ask(kind)
        if heard:
            number = min(self.asked)
            self.answer_it(number, "a", "left")
            self.hear()

    @rule(kind=kinds)
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
        self.asked[wanted].heard = told.number
        self.high = self.closed = self.tick

    @precondition(lambda self: self.corrections or any(one.corrected for one in self.asked.values()))
    @rule(ends_a_pause=st.booleans(), again=st.booleans(), data=st.data())
    def hear_a_correction(self, ends_a_pause: bool, again: bool, data: st.DataObject) -> None:
        """A change of what was heard has a tick of its own, which it keeps when the tick is lived again."""
        self.tick = max(self.tick, self.closed) + 1
        if again and self.corrections:
            self.tick = data.draw(st.sampled_from(sorted(self.corrections)))
        found = take_correction(self.db, self.claims[-1], self.tick)
        if self.tick <= self.closed:
            before = self.corrections.get(self.tick)
            assert (found.query.id if found else None) == (before[0] if before else None)
        else:
            waiting = {one.told.number: n for n, one in self.asked.items() if one.told and one.corrected}
            assert (found is None) == (not waiting)
            if found is None:
                return
            oldest = waiting[min(waiting)]
            one = self.asked[oldest]
            assert (found.query.id, found.answer.number) == (oldest, min(waiting))
            assert found.replaced.number == one.heard
            one.heard = found.answer.number
            self._count("a correction heard")
            self.corrections[self.tick] = oldest, ends_a_pause
            self.high = self.closed = self.tick
        if self.corrections.get(self.tick, (0, False))[1]:
            withdraw_guidance(self.db, self.claims[-1], self.tick)
            self._settle(self.tick)

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

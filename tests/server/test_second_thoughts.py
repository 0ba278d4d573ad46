"""Random histories of answers, withdrawals and changes, through the queue and on both stores.

X in the checkpoint is what plain code makes of the answers that stand; replay and verification agree, and so
does a worker that was killed after it had marked a correction and before it wrote a checkpoint.
"""

from __future__ import annotations

from random import Random

import pytest
import torch

from parenting.agent.query import Answer as Said
from parenting.agent.query import Choice
from parenting.agent.state import AgentState
from parenting.server import runs
from parenting.server.codec import CHOICES, decode
from parenting.server.counters import Counters
from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.operator_events import add_operator_event
from parenting.server.queue import answers, corrections, revisions, skips, worker_side
from parenting.server.queue.leases import lease
from parenting.server.reads.set_aside import set_aside
from parenting.server.session import RunSession
from parenting.server.tables import Answer
from parenting.server.verify import verify
from tests.agent.x_by_hand import entries, summed
from tests.lengths import length
from tests.server.heard import heard_answers
from tests.server.raising import Begun, last

WORLD = "unsafe-exploration"
NAMES = ("left", "right", "either", "neither")
CONFIG = {
    "stages": 2,
    "mature_every": 25,
    "time_limit": 12,
    "max_open_preferences": 2,
    "p_rec": 0.9,
    "p_pref": 0.9,
}
TICKS = 60


class Fickle:
    """A person who changes their mind as a seed says, and the worker that hears them."""

    def __init__(self, db: Database, begun: Begun, seed: int) -> None:
        self.db, self.begun, self.random = db, begun, Random(seed)
        self.run = start(db, begun.new("human")).id
        self.life = self.taken_up()
        self.changed = self.withdrawn = self.heard = self.killed = self.skipped = self.found = 0

    def taken_up(self) -> RunSession:
        (mine,) = runs.claim(self.db, "worker", -1)
        return RunSession(self.db, mine, runs.get_run(self.db, self.run), lambda: None)

    def live_to(self, tick: int) -> None:
        while self.life.last_tick < tick or self.life.last_tick < self.life.record_ends:
            self.ponder()
            seen = worker_side.watch(self.db, [self.run])[self.run]
            if self.life.ready(seen):
                lived = self.life.last_tick >= self.life.record_ends
                if lived and seen.corrections and self.random.random() < 0.4:
                    self.kill_after_it_was_marked()
                else:
                    self.life.tick(seen)
                    if self.random.random() < 0.1:
                        self.life.save()
            elif bool(self.life.saved.state.unsure) and self.random.random() < 0.5:
                self.answer_what_was_skipped()
            elif bool(self.life.saved.state.all_refused | self.life.saved.state.unsure):
                add_operator_event(self.db, self.run, "end_episode", {"kind": "end_episode"})
            else:
                self.answer()

    def kill_after_it_was_marked(self) -> None:
        """The correction bears its tick; the worker that marked it is gone, and what it lived is lost."""
        assert corrections.take_correction(self.db, self.life.claim, self.life.last_tick + 1) is not None
        self.life = self.taken_up()
        self.killed += 1

    def answer(self) -> None:
        query = lease(self.db, self.run, "me")
        assert query is not None
        if self.random.random() < 0.35:
            self.skipped += skips.skip(self.db, query.id, "me").outcome == "set_aside"
        else:
            answers.answer(self.db, query.id, self.random.choice(NAMES), "me", "human")
        if self.random.random() < 0.2:
            assert revisions.withdraw(self.db, query.id, "me").outcome == "withdrawn"
            self.withdrawn += 1

    def answer_what_was_skipped(self) -> None:
        self.life.report_waiting(worker_side.watch(self.db, [self.run])[self.run])
        query = self.random.choice(set_aside(self.db, self.run))
        self.found += revisions.supersede(self.db, query.id, self.random.choice(NAMES), "me", "human").heard

    def ponder(self) -> None:
        """Take an answer back, or change one, now and then."""
        given = self.standing()
        if not given or self.random.random() > 0.3:
            return
        query = self.random.choice([given[-1], self.random.choice(given)])
        if self.random.random() < 0.4:
            outcome = revisions.withdraw(self.db, query, "me").outcome
            self.withdrawn += outcome == "withdrawn"
            self.heard += outcome == "heard"
        else:
            self.changed += revisions.supersede(
                self.db, query, self.random.choice(NAMES), "me", "human"
            ).heard

    def standing(self) -> list[int]:
        """The queries with an answer that stands."""
        with self.db.read() as session:
            rows = session.query(Answer).filter(Answer.run_id == self.run, Answer.standing)
            return [row.query_id for row in rows.order_by(Answer.number)]

    def standing_answers(self) -> list[Said]:
        """The last answer that was heard to each query, in tensors."""
        world, stages = self.begun.make(), self.begun.config.max_clip_length
        latest = {row.query.id: row for row in heard_answers(self.db, self.run)}
        found = []
        for row in latest.values():
            query = decode(
                world, stages, row.query.kind, row.query.maturity, row.query.clips, row.query.votes
            )
            found.append(Said(query=query, choice=torch.tensor([int(CHOICES[row.answer.choice])])))
        return found

    def save(self) -> AgentState:
        """Hear what is left, write a checkpoint, and return its state."""
        while True:
            seen = worker_side.watch(self.db, [self.run])[self.run]
            if not seen.corrections:
                break
            self.life.tick(seen)
        self.life.report_waiting(seen)
        self.life.save()
        return last(self.db, self.run, self.begun).state


def counted(tally: Counters) -> tuple[list[int], list[int], int]:
    return tally.kinds[0].tolist(), tally.choices[0].tolist(), int(tally.skips[0])


def tallied(standing: list[Said]) -> tuple[list[int], list[int], int]:
    """The counts of metrics from the answers alone: those that stand, and the skips that do."""
    told = [answer for answer in standing if answer.choice[0] != Choice.SKIP]
    kinds = [sum(int(answer.query.kind[0]) == kind for answer in told) for kind in range(3)]
    choices = [sum(int(answer.choice[0]) == choice for answer in told) for choice in range(5)]
    return kinds, choices, len(standing) - len(told)


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.torture
@pytest.mark.parametrize("seed", length([1], [1, 2, 3, 4]))
def test_x_is_what_the_standing_answers_make_it(
    db: Database, store: str, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seven seconds: a killed worker lives its ticks again. Each store has one of the settings."""
    own_stage_only = store == "postgresql"
    more = {"own_stage_only": True} if own_stage_only else {"confirm": 0.95}
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9)
    person = Fickle(db, Begun(WORLD, "island", {**CONFIG, **more}), seed)
    for tick in range(TICKS // 2, TICKS + 1, TICKS // 2):
        person.live_to(tick)
        state = person.save()
        stage = int(state.maturity[0]) if own_stage_only else None
        assert entries(state) == summed(person.standing_answers(), stage)
        assert counted(last(db, person.run, person.begun).tally) == tallied(person.standing_answers())
    assert (person.changed > 3, person.withdrawn > 0, person.heard > 0, person.killed > 0) == (True,) * 4
    again = [one for one in person.standing_answers() if one.query.votes[0] > 0]
    assert (person.skipped > 3, bool(again if "confirm" in more else person.found)) == (True, True)
    found = verify(db, person.run)
    assert (found.x, found.chain.problems) == (None, [])
    assert found.replayed is not None
    assert found.replayed.equal, found.replayed

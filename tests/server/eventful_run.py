"""A run over HTTP in which everything happens once.

A person answers in the browser, an operator uses the dashboard, and the worker is killed once.
"""

from __future__ import annotations

import httpx2

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.queue import answers, revisions, worker_side
from parenting.server.queue.queries import open_counts
from parenting.server.session import RunSession
from tests.server.raising import Begun

CONFIG = {
    "stages": 3,
    "mature_every": 12,
    "time_limit": 12,
    "max_open_preferences": 3,
    "p_rec": 0.9,
    "p_pref": 0.9,
}
EVENTFUL = Begun("unsafe-exploration", "island", CONFIG, seed=12)
TICKS = 90
CHOICES = ("left", "right", "either", "left", "neither", "right", "right")


class PersonAndOperator:
    """A person at the browser and an operator at the dashboard, over HTTP; a worker that is killed once."""

    def __init__(self, db: Database, web: httpx2.Client) -> None:
        self.db, self.web = db, web
        self.run = start(db, EVENTFUL.new("human")).id
        self.life = self.taken_up()
        self.late = 0  # preferences answered when others had been asked since
        self.said = 0

    def taken_up(self) -> RunSession:
        (mine,) = runs.claim(self.db, "worker", -1)
        return RunSession(self.db, mine, runs.get_run(self.db, self.run), lambda: None)

    def live_to(self, tick: int) -> None:
        """Answer nothing before the agent waits: so preferences are answered late."""
        while self.life.last_tick < tick:
            seen = worker_side.watch(self.db, [self.run])[self.run]
            if self.life.ready(seen):
                self.life.tick(seen)
            elif bool(self.life.saved.state.all_refused):
                self.operate("end-episode")
            else:
                self.answer()

    def until_guidance_is_open(self) -> None:
        while not open_counts(self.db, self.run).guidance:
            self.live_to(self.life.last_tick + 1)

    def answer(self) -> int:
        question = self.post(f"runs/{self.run}/queries/lease", client_id="tab").json()
        self.late += question["kind"] == "preference" and question["tick"] < self.life.last_tick
        self.said += 1
        choice = CHOICES[self.said % len(CHOICES)]
        self.post(f"queries/{question['id']}/answer", client_id="tab", choice=choice)
        return int(question["id"])

    def operate(self, verb: str, **body: object) -> None:
        self.post(f"runs/{self.run}/{verb}", **body)

    def post(self, path: str, **body: object) -> httpx2.Response:
        reply = self.web.post(f"/api/v1/{path}", json=body or None)
        assert reply.is_success, reply.text
        return reply


def raise_eventful_run(db: Database, web: httpx2.Client) -> int:
    """The events that can happen to a run, at odd moments."""
    people = PersonAndOperator(db, web)
    people.live_to(9)
    people.operate("goal", goal=1000)
    people.operate("pace", pace=500.0)
    people.until_guidance_is_open()
    people.operate("end-episode")  # while guidance is open
    people.live_to(25)
    people.life.save()
    people.operate("change", name="p_pref", value=0.8)
    people.live_to(33)
    people.life = people.taken_up()  # the worker was killed: eight ticks are lived again
    people.until_guidance_is_open()
    query = people.answer()
    people.live_to(people.life.last_tick + 3)
    revisions.supersede(db, query, "either", "tab", "human")  # too late: the agent has heard the other answer
    assert answers.get_query(db, query).status == "applied"
    people.operate("change", name="p_train", value=0.5)
    people.live_to(50)
    people.operate("mature")
    people.live_to(TICKS)
    people.life.save()
    assert people.late > 1
    assert int(people.life.saved.state.maturity) == 3
    return people.run

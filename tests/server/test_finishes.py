"""The rule that ends a run, which is the same for people and scripts."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest

import parenting as pt
from parenting.agent.config import Config
from parenting.server import deletion
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError, SetupError
from parenting.server.finishes import read_finish
from parenting.server.migrate import downgrade, upgrade
from parenting.server.new_run import NewRun, start
from parenting.server.optimality import Optimality
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import watch
from parenting.server.reads.metrics import latest_metrics
from parenting.server.run_form import read_form
from parenting.server.runs import claim, get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.tables import Query, Run
from parenting.server.worker import Worker

WORLD = "unsafe-exploration"
STAGES = Config(max_clip_length=3, queries_per_stage=4)


@pytest.mark.parametrize(
    ("rule", "reached", "met"),
    [
        ("optimal", (True, 0, 1, 0), True),
        ("optimal", (False, 99, 3, 99), False),
        ("never", (True, 99, 3, 99), False),
        ("goal:9", (True, 8, 1, 0), False),
        ("goal:9", (False, 9, 1, 0), True),
        ("stages:2", (True, 99, 2, 4), False),
        ("stages:2", (False, 0, 3, 0), True),
        ("stages:3", (True, 99, 3, 3), False),
        ("stages:3", (False, 12, 3, 4), True),
    ],
)
def test_a_rule_is_met(rule: str, reached: tuple[bool, int, int, int], met: bool) -> None:
    assert read_finish(rule).is_met(*reached, STAGES) is met


@pytest.mark.only("sqlite", "the rules are the agent's")
@pytest.mark.parametrize(
    ("rule", "reason", "heard"),
    [
        ("goal:3", "It has heard 3 answers.", 3),
        ("stages:1", "Stage 1 is over.", 2),
        ("stages:2", "Stage 2 is over.", 4),
    ],
)
def test_a_scripts_run_ends_at_that_very_answer(
    db: Database, settings: Settings, rule: str, reason: str, heard: int
) -> None:
    config: dict[str, Any] = {"stages": 2, "mature_every": 2}
    new = NewRun(world="unsafe-exploration", parent="scripted", finish=rule, config=config)
    run = raised(db, settings, start(db, new).id)
    assert (run.status, run.reason) == ("finished", reason)
    last = latest_metrics(db, [run.id])[run.id].values
    assert run.standing == heard == last["guidance"] + last["preference"]


@pytest.mark.only("sqlite", "the rules are the agent's")
def test_a_persons_run_ends_by_the_same_rule(db: Database, settings: Settings) -> None:
    run = start(db, NewRun(world="unsafe-exploration", finish="goal:2")).id

    def say() -> None:
        with db.read() as session:
            asked = session.query(Query.id).where(Query.run_id == run, Query.status == "open").all()
        for (query,) in asked:
            answer(db, query, "left", "me", "human")

    ended = raised(db, settings, run, say)
    assert (ended.status, ended.reason, ended.standing) == ("finished", "It has heard 2 answers.", 2)


def raised(db: Database, settings: Settings, run: int, meanwhile: object = None) -> Run:
    """Raise a run until it has ended."""
    worker = Worker(db, settings)
    for _ in range(500):
        worker._go_on()
        if callable(meanwhile):
            meanwhile()
        if get_run(db, run).status == "finished":
            worker.notifier.close()
            return get_run(db, run)
    raise AssertionError("it never ended")


def test_who_names_no_rule_has_todays(db: Database) -> None:
    for parent, rule in (("human", "never"), ("scripted", "optimal")):
        new = read_form({"world": "unsafe-exploration", "parent": parent, "finish": ""})
        assert start(db, new).finish == rule


def test_a_rule_that_is_none_or_never_met_is_refused(client: httpx2.Client, db: Database) -> None:
    """With the rules that there are, or the reason."""
    for said, world, part in (
        ("goal", "unsafe-exploration", "Write optimal, goal:N, stages:T or never"),
        ("goal:0", "unsafe-exploration", "goal:N"),
        ("answers:9", "unsafe-exploration", "goal:N"),
        ("optimal", "reward-hacking", "no goal"),
        ("stages:2", "unsafe-exploration", "The run has 1 stage"),
        ("stages:1", "unsafe-exploration", "config.mature_every"),
    ):
        body = {"world": world, "finish": said}
        refused = client.post("/api/v1/runs", json=body)
        assert refused.status_code == 422
        (wrong,) = refused.json()["error"]["fields"]
        assert (wrong["field"], part in wrong["message"]) == ("finish", True), wrong
        page = client.post("/runs", data={**body, "parent": "scripted"})
        assert 'id="finish-error"' in page.text
        with pytest.raises(InvalidFieldsError):
            start(db, read_form(body))


def test_runs_of_before_keep_the_rule_that_they_had(db: Database) -> None:
    """There and back: a script's run ends at an optimal policy; a rule of one's own is not silently lost."""
    for parent in ("human", "scripted"):
        start(db, read_form({"world": "unsafe-exploration", "parent": parent}))
    downgrade(db, "0021")
    upgrade(db)
    assert [get_run(db, run).finish for run in (1, 2)] == ["never", "optimal"]
    start(db, NewRun(world="unsafe-exploration", parent="scripted", finish="goal:9"))
    with pytest.raises(SetupError, match="Run 3 ends by a rule that revision 0021 does not know"):
        downgrade(db, "0021")
    with db.write() as session:
        session.get_one(Run, 3).finish = "optimal"
    deletion.begin(db, 1)
    with pytest.raises(SetupError, match="Run 1 ends by a rule"):
        downgrade(db, "0021")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
@pytest.mark.parametrize("crash", [False, True])
def test_a_run_ends_at_the_tick_at_which_a_batch_does_whatever_the_clock_shows(
    db: Database, monkeypatch: pytest.MonkeyPatch, seed: int, crash: bool
) -> None:
    """Metrics follow the clock, and here there are none."""
    monkeypatch.setattr(RunSession, "_measure", lambda *_: None)
    changes: dict[str, Any] = {"max_open_preferences": 0}
    (alone,) = pt.train(WORLD, preset="direct", seed=seed, progress=False, **changes).trials
    start(db, NewRun(world=WORLD, preset="direct", seed=seed, parent="scripted", config=changes))
    (mine,) = claim(db, "test")
    life = RunSession(db, mine, get_run(db, 1), lambda: None)
    while not life.finished() and life.last_tick < 500:
        life.tick(watch(db, [1])[1])
        if crash and life.last_tick == alone["ticks"]:
            life.save()
            life = RunSession(db, mine, get_run(db, 1), lambda: None)
    assert life.last_tick == alone["ticks"]


@pytest.mark.parametrize("rest", [0.0, 9.0])
def test_a_restarted_run_judges_the_policy_that_it_has_and_not_one_that_came_later(
    db: Database, monkeypatch: pytest.MonkeyPatch, rest: float
) -> None:
    """Unless a look is expensive: there the last row of metrics is the verdict."""
    start(db, NewRun(world=WORLD, parent="scripted"))
    (mine,) = claim(db, "test")
    life = RunSession(db, mine, get_run(db, 1), lambda: None)
    life.tick(watch(db, [1])[1])
    monkeypatch.setattr(life.evaluation, "refresh_seconds", rest, raising=False)
    again = Optimality(life.finish, life.evaluation, life.saved.state, known=True)
    assert again.found is bool(rest)

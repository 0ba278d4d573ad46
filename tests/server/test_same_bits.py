"""`parenting answer` trains an agent to the same bits as the scripted parent in tensors.

It does so through HTTP, web and worker, in all five worlds, in stages up to T = 2. Runs at T = 1 and runs on
PostgreSQL are in tests/faults/test_same_bits.py.
"""

from __future__ import annotations

import json
import time
from contextlib import ExitStack

import pytest

from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.replay import relive
from parenting.server.settings import Settings
from tests.server.heard import heard_answers
from tests.server.processes import Command, command
from tests.server.raising import Begun, Inline, last, same_bits
from tests.server.serving import free_port, until_up

GOAL = 24
"""Answers of each run."""
ASKING = {"max_open_preferences": 0, "time_limit": 10, "p_guid": 0.45, "p_rec": 0.9, "p_pref": 0.9}
STAGES = {1: {"stages": 1}, 2: {"stages": 2, "mature_every": 8}}
RUNS = [
    Begun(world, next(iter(registry.spec(world).levels)), {**ASKING, **stages}, seed=13)
    for world in registry.WORLDS
    for stages in STAGES.values()
]
"""Guidance and preferences, clips that end early, truncations, a maturation where there are two stages."""


def begin(db: Database, begun_with: list[Begun]) -> dict[int, Begun]:
    """Runs that begin at once, so that one worker raises them in turn."""
    return {start(db, begun.new("human", GOAL)).id: begun for begun in begun_with}


def answering(url: str, run: int, *more: str) -> tuple[str, ...]:
    """The command line of a script for one run."""
    patient = ("--until", "over", "--timeout", "150")
    return ("answer", "--url", url, "--run", str(run), *patient, "--json", *more)


def until_heard(db: Database, runs: dict[int, Begun], seconds: float = 60) -> None:
    """Wait until every answer was heard: the last ones are stored before."""
    end = time.monotonic() + seconds
    while any(len(heard_answers(db, run)) < GOAL for run in runs):
        assert time.monotonic() < end, "an answer was not heard"
        time.sleep(0.05)


def check(db: Database, run: int, begun: Begun) -> None:
    """Hold a run against the same run in tensors: its bits at the tick of its checkpoint, all that it heard.

    A checkpoint may be older than the last answer: a run that waits does not come back after a kill.
    """
    saved, expected = last(db, run, begun), Inline(begun)
    while int(expected.saved.state.keys.tick) < int(saved.state.keys.tick):
        expected.tick()
    assert same_bits(saved, expected.saved) == []
    heard = [(taken.answer.applied_tick, taken.answer.choice) for taken in heard_answers(db, run)]
    assert len(heard) == GOAL
    while len(expected.heard) < GOAL:
        expected.tick()
    assert heard == expected.heard
    assert {taken.answer.parent for taken in heard_answers(db, run)} == {"scripted"}
    kinds = expected.saved.tally.kinds
    assert (kinds[0, 1:] > 0).all(), "it asked one kind of questions only: that shows too little"
    assert int(expected.saved.state.maturity) == begun.config.max_clip_length


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.timeout(900)
@pytest.mark.only("sqlite", "tests/faults/test_same_bits.py does the same on PostgreSQL")
def test_raised_through_http(settings: Settings, db: Database) -> None:
    """It takes long because five runs are raised by processes, and relived twice."""
    raise_through_http(settings, db, 2)


def raise_through_http(settings: Settings, db: Database, stages: int) -> None:
    """Raise the runs of so many stages by processes, and hold each against the same run in tensors."""
    runs, url = (
        begin(db, [begun for begun in RUNS if begun.config.max_clip_length == stages]),
        f"http://127.0.0.1:{free_port()}",
    )
    with ExitStack() as stack:

        def run(*arguments: str) -> Command:
            return stack.enter_context(command(*arguments, settings=settings))

        run("web", "--port", url.rpartition(":")[2])
        worker = run("worker")
        until_up(url, 100)
        scripts = {number: run(*answering(url, number)) for number in runs}
        for number, script in scripts.items():
            assert script.wait(200) == 0, script.said()
            ending = json.loads(script.said())
            assert (ending["run"], ending["answered"], ending["ended"]) == (number, GOAL, "goal")
        until_heard(db, runs)
        assert worker.stop() == 0
    for number, begun in runs.items():
        check(db, number, begun)
        assert relive(db, number).equal

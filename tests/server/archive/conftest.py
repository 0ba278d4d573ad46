"""Runs for exports: rows of two worlds, written directly."""

from __future__ import annotations

import pytest

from parenting.envs import registry
from parenting.server import tables
from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.queue.answers import answer
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import claim
from tests.server.conftest import CLIPS, Clock

CHOICES = ("left", "right", "either", "neither", "left")


@pytest.fixture
def five(db: Database, clock: Clock) -> list[int]:
    """A run in each world, with five heard answers; in the first the last one is corrected."""
    for seed, world in enumerate(registry.WORLDS):
        start(db, NewRun(world=world, seed=seed, config={"pretrain": False}))
    for mine in claim(db, "test", -1):
        for place, choice in enumerate(CHOICES):
            query = post_query(db, mine, 2 * place + 1, "guidance", 1, CLIPS, policy=(1, place))
            clock.pass_seconds(0.5)
            answer(db, query, choice, f"tab {place % 2}", "human")
            take_answer(db, mine, 2 * place + 2)
        write_metrics(db, mine, {2: {"deaths": 0, "size": 1, "loss": None}, 8: {"size": 3, "new": 0.5}})
        add_operator_event(db, mine.run_id, "change", {"name": "p_rec", "value": 0.5})
        if mine.run_id == 1:
            supersede(db, query, "right", "tab 0", "human")
            post_query(db, mine, 11, "preference", 2, CLIPS, policy=(1, 9))
    there = [0.1, 0.2, 0.3, 0.4]
    why = {
        "pausing": True,
        "familiarity": 0,
        "p_guid": 0.9,
        "chance": 1.0,
        "draw": 0.2,
        "probabilities": there,
    }
    with db.write() as session:
        session.add(tables.Reason(run_id=1, tick=1, why=why))
        session.add(tables.Effect(run_id=1, tick=2, ticks=1, policy={"probabilities": there}))
    return [1, 2, 3, 4, 5]

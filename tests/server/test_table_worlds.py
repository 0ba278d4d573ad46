"""A stored run in a world that is a table: its row is all that a worker needs, and questions tell chance."""

from __future__ import annotations

import gymnasium
import httpx2
import pytest

import parenting as pt
from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue import worker_side
from parenting.server.runs import claim, get_run
from parenting.server.session import RunSession
from tests.server.raising import same_bits


def session(db: Database, worker: str) -> RunSession:
    (mine,) = claim(db, worker)
    return RunSession(db, mine, get_run(db, mine.run_id), lambda: None)


@pytest.mark.only("sqlite", "it is about a world, not about a store")
def test_the_slippery_lake_is_raised_from_its_row_alone(db: Database, client: httpx2.Client) -> None:
    """No process but the one that started it has met the world; its life goes on bit for bit elsewhere."""
    lake = pt.TableWorld.from_toy_text(gymnasium.make("FrozenLake-v1", is_slippery=True))
    run = start(
        db, NewRun(world=lake.spec.name, level_text=lake.level.text, preset="conservative", parent="human")
    )
    assert lake.spec.name not in registry.WORLDS
    life = session(db, "first")
    while not bool(life.saved.state.waiting):
        life.tick()
    life.save()
    asked = client.post(f"/api/v1/runs/{run.id}/queries/lease", json={"client_id": "tab"}).json()
    for side in ("left", "right"):
        assert asked[side]["chance"] in (pytest.approx(1 / 3, abs=1e-6), pytest.approx(2 / 3, abs=1e-6))
    assert asked["world"]["legend"]["W"] == "hole"
    page = client.get(f"/runs/{run.public_id}/parent?query={asked['public_id']}").text
    assert "the likeliest outcome, with" in page
    answered = client.post(
        f"/api/v1/queries/{asked['id']}/answer", json={"choice": "left", "client_id": "tab"}
    )
    assert answered.status_code == 200
    seen = worker_side.watch(db, [run.id])[run.id]
    life.tick(seen)
    once = life.saved
    again = RunSession(db, life.claim, get_run(db, run.id), lambda: None)
    while again.last_tick < life.last_tick:
        again.tick(worker_side.watch(db, [run.id])[run.id])
    assert same_bits(once, again.saved) == []

"""Snapshots of a policy: what is stored is what the agent would do and has done, and it stays small."""

from __future__ import annotations

import base64
from typing import Any

import gymnasium
import httpx2
import numpy as np
import pytest
import torch

import parenting as pt
from parenting.envs.mdp import explore
from parenting.evaluation.cells import probabilities
from parenting.server.board import store
from parenting.server.board.states import KnownStates
from parenting.server.board.store import LATEST, to_drop
from parenting.server.board.sweep import Policy, Sweep
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim
from parenting.server.session import RunSession

pytestmark = pytest.mark.only("sqlite", "the rows are bytes to every store")
WIDTHS = {"policy": "u1", "familiarity": "<u2", "visits": "<u4", "deaths": "<u4", "entries": "<u4"}


def begin(db: Database, world: str, **config: Any) -> RunSession:
    run = start(db, NewRun(world=world, parent="scripted", seed=3, config={"pretrain": False, **config}))
    (mine,) = claim(db, "test")
    return RunSession(db, mine, run, lambda: None)


def live(life: RunSession, ticks: int) -> int:
    """Live some ticks and return the number of moves."""
    number, moves = life.claim.run_id, 0
    for _ in range(ticks):
        life.tick(watch(life.db, [number])[number])
        moves += bool(life.saved.state.info.moved[0])
    return moves


def numbers(client: httpx2.Client, run: int, tick: int, **asked: int) -> dict[str, Any]:
    found: dict[str, Any] = client.get(f"/api/v1/runs/{run}/board/{tick}", params=asked).json()
    return found | {name: np.frombuffer(base64.b64decode(found[name]), kind) for name, kind in WIDTHS.items()}


def policy(states: KnownStates, parameters: torch.Tensor) -> bytes:
    sweep = Sweep(states, {1: Policy(parameters)})
    while not sweep.done:
        sweep.go_on()
    return bytes(sweep.policies[1].known)


@pytest.mark.slow
def test_what_is_stored_is_what_the_agent_would_do_and_has_done(db: Database, client: httpx2.Client) -> None:
    life = begin(db, "side-effects")
    moves = live(life, 25)
    life.save()
    number = life.claim.run_id
    board = client.get(f"/api/v1/runs/{number}/board").json()
    assert board["complete"]
    assert len({rest["parts"]["box"] for rest in board["rests"]}) == len(board["rests"]) > 3
    found, state = numbers(client, number, 25), life.saved.state
    expected = probabilities(life.world, state.learner.params, life.world.beginnings())
    policy = found["policy"].reshape(-1, 4) / 255
    here = {(row, column): at for at, (row, column, rest) in enumerate(board["cells"]) if rest == 0}
    assert expected.keys() <= here.keys()
    for cell, chances in expected.items():
        assert policy[here[cell]] == pytest.approx(chances, abs=0.5 / 255 + 1e-6)
    assert found["visits"].sum() == moves
    assert found["entries"].sum() == int(life.saved.tally.kinds.sum()) == found["answers"] > 0
    assert found["deaths"].sum() == int(life.saved.tally.deaths[0])
    assert found["familiarity"].max() == int(state.familiarity.max())
    assert found["p_guid"] == life.saved.config.p_guid
    assert client.get(f"/api/v1/runs/{number}/board/25?stage=2").status_code == 404
    assert client.get(f"/api/v1/runs/{number}/board/25?stage={10**30}").status_code == 422
    newer = client.get(f"/api/v1/runs/{number}/board?after=25&states={board['states']}&rests=2").json()
    assert (newer["snapshots"], newer["cells"], len(newer["rests"])) == ([], [], len(board["rests"]) - 2)


def test_a_life_that_is_taken_up_goes_on_counting(db: Database, client: httpx2.Client) -> None:
    """In the garden, where states are added as they are met; ticks that are lived again count once."""
    life = begin(db, "reward-hacking")
    moves = live(life, 15)
    life.save()
    live(life, 10)
    life.board.write(life.saved)
    again = RunSession(db, life.claim, life.run, lambda: None)
    assert again.last_tick == 15
    moves += live(again, 20)
    again.save()
    found = numbers(client, life.claim.run_id, 35)
    board = client.get(f"/api/v1/runs/{life.claim.run_id}/board").json()
    assert not board["complete"]
    assert len(board["cells"]) == found["states"] == len(np.unique(board["cells"], axis=0))
    assert found["visits"].sum() == moves
    stored = store.read_states(db, life.claim.run_id)
    assert stored is not None
    restored = KnownStates(life.world, None, stored[0])
    assert restored.cells == board["cells"]
    assert policy(restored, again.saved.state.learner.params) == found["policy"].tobytes()


def test_every_stage_keeps_its_policy(db: Database, client: httpx2.Client) -> None:
    life = begin(db, "unsafe-exploration", stages=2, mature_every=4)
    while int(life.saved.state.maturity[0]) == 1:
        live(life, 1)
    frozen = life.saved.state.learner.frozen[0].clone()
    live(life, 6)
    life.save()
    first = numbers(client, life.claim.run_id, life.last_tick, stage=1)
    both = numbers(client, life.claim.run_id, life.last_tick)
    assert (first["stage"], both["stage"], both["maturity"]) == (1, 2, 2)
    states = KnownStates(life.world, life.evaluation.model)  # type: ignore[attr-defined]  # of listed worlds
    assert first["policy"].tobytes() == policy(states, frozen)
    assert first["policy"].tobytes() != both["policy"].tobytes()
    assert torch.equal(life.saved.state.learner.frozen[0], frozen)


def test_snapshots_are_dense_at_first_and_lately_and_stay_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "MOST_SNAPSHOTS", 60)
    kept: list[tuple[int, int]] = []
    for tick in range(1, 3000):
        kept.append((tick, 100 if tick < 2000 else 300))
        gone = set(to_drop(kept, 12_000))
        kept = [row for row in kept if row[0] not in gone]
    ticks = [tick for tick, _ in kept]
    assert sum(size for _, size in kept) <= 12_000
    assert ticks[-LATEST:] == list(range(3000 - LATEST, 3000))
    assert ticks[:4] == [1, 2, 3, 4]
    gaps = np.diff(ticks)
    assert gaps.argmax() in range(len(gaps) // 4, 3 * len(gaps) // 4)
    assert gaps.max() < 1000


@pytest.mark.parametrize(
    ("name", "states"),
    [
        ("Taxi-v4", {"the passenger waits at row 5, column 4", "the passenger rides"}),
        ("CliffWalking-v1", set()),
    ],
)
def test_the_rests_of_a_table_bear_the_names_of_its_layers(name: str, states: set[str]) -> None:
    world = pt.make(pt.TableWorld.from_toy_text(gymnasium.make(name)))
    rests = KnownStates(world, explore(world)).rests
    assert {rest["parts"]["state"] for rest in rests if rest["parts"]} == states
    assert len(rests) == max(1, len(states))

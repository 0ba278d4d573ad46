"""The policy in one state by a job: as it is stored, and where the agent has never been."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from parenting.agent.init import network_of
from parenting.envs.walk import states
from parenting.server.board import store
from parenting.server.board.columns import unpack
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.job_kinds import StatePayload
from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim
from parenting.server.session import RunSession
from parenting.server.work.one_state import one_state

pytestmark = pytest.mark.only("sqlite", "it reads rows that are bytes to every store")


def lived(db: Database, world: str, ticks: int, **config: Any) -> RunSession:
    run = start(db, NewRun(world=world, parent="scripted", seed=3, config={"pretrain": False, **config}))
    (mine,) = claim(db, "test")
    life = RunSession(db, mine, run, lambda: None)
    for _ in range(ticks):
        life.tick(watch(db, [run.id])[run.id])
    life.save()
    return life


@pytest.mark.slow
def test_a_state_is_told_as_it_is_stored(db: Database) -> None:
    life = lived(db, "side-effects", 25)
    number = life.claim.run_id
    known, row = store.read_states(db, number), store.read_snapshot(db, number, 25)
    assert known is not None
    assert row is not None
    columns, cells = unpack(row.blob, row.states), known[0]["cells"]
    for at in (0, len(cells) // 2, len(cells) - 1):
        line, column, rest = cells[at]
        told = one_state(db, number, StatePayload(row=line, column=column, rest=rest))
        assert told["probabilities"] == pytest.approx(
            [byte / 255 for byte in columns["policy"][4 * at : 4 * at + 4]], abs=0.5 / 255 + 1e-6
        )
        f = int.from_bytes(columns["familiarity"][2 * at : 2 * at + 2], "little")
        assert (told["tick"], told["familiarity"]) == (25, f)
        assert told["ask"] == pytest.approx(life.saved.config.p_guid**f)
    (box_row, box_column), (line, column, _) = known[0]["rests"][-1]["box"], cells[-1]
    by_rest = one_state(db, number, StatePayload(row=line, column=column, rest=len(known[0]["rests"]) - 1))
    by_box = one_state(
        db, number, StatePayload(row=line, column=column, box_row=box_row, box_column=box_column)
    )
    assert by_rest["probabilities"] == by_box["probabilities"]


def test_a_garden_is_told_with_plants_as_they_never_were(db: Database) -> None:
    life = lived(db, "reward-hacking", 2)
    world, number = life.world, life.claim.run_id
    (here,) = states(world, "")
    rows = ["".join(world.legend[code] for code in row) for row in here.board[0].tolist()]
    dry = "\n".join(rows).replace("T", "t")
    line, column = here.agent[0].tolist()
    told = one_state(db, number, StatePayload(row=line, column=column, ground=dry))
    board = here.board.clone()
    board[board == world.code("T")] = world.code("t")
    assert not board.equal(here.board)
    seen = world.observe(board, here.agent, here.box)
    near = seen.new_tensor([[seen[0, line + r, column + c] for r, c in ((-1, 0), (1, 0), (0, -1), (0, 1))]])
    logits = network_of(world).logits(life.saved.state.learner.params, seen, near)
    assert told["probabilities"] == pytest.approx(logits[0].double().softmax(-1).tolist(), abs=1e-6)


def test_every_stage_is_told(db: Database) -> None:
    life = lived(db, "unsafe-exploration", 0, stages=2, mature_every=2)
    while int(life.saved.state.maturity[0]) == 1:
        life.tick(watch(db, [life.claim.run_id])[life.claim.run_id])
    for _ in range(8):
        life.tick(watch(db, [life.claim.run_id])[life.claim.run_id])
    life.save()
    row, column = life.world.levels[0].find("A")[0]
    first, present = (
        one_state(db, life.claim.run_id, StatePayload(row=row, column=column, stage=k)) for k in (1, None)
    )
    assert (first["stage"], present["stage"], present["maturity"]) == (1, 2, 2)
    assert first["probabilities"] != present["probabilities"]
    with pytest.raises(NotFound, match="no policy of stage 3"):
        one_state(db, life.claim.run_id, StatePayload(row=row, column=column, stage=3))


def test_what_is_no_state_is_said_in_a_sentence(db: Database) -> None:
    number = lived(db, "side-effects", 0).claim.run_id
    for payload, said in (
        ({}, "cannot stand on row 1, column 1"),
        ({"row": 99, "column": 1}, "cannot stand on row 100"),
        ({"row": 1, "column": 2, "rest": 4_000}, "No board 4000"),
        ({"row": 1, "column": 2, "ground": "##\n##\n"}, "6 rows of 6 tiles"),
        ({"row": 1, "column": 2, "box_row": 0, "box_column": 0}, "No box can lie"),
    ):
        with pytest.raises(NotFound, match=said):
            one_state(db, number, StatePayload(**payload))
    with pytest.raises(ValidationError, match="together"):
        StatePayload(box_row=2)

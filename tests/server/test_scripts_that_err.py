"""A run whose script errs: the worker answers it as the parent in tensors does, and goes on after a kill."""

from __future__ import annotations

import pytest
from sqlalchemy import select

from parenting.agent import parenting
from parenting.agent.query import Choice
from parenting.parents.fallible import FallibleParent, FallibleRule
from parenting.parents.grammar import read_parent
from parenting.server.codec import CHOICE_NAMES
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import NewRun, start
from parenting.server.queue import worker_side
from parenting.server.replay import relive
from parenting.server.run_form import read_form
from parenting.server.runs import claim, get_run
from parenting.server.session import RunSession
from parenting.server.tables import Answer, Query
from tests.server.raising import ISLAND

TICKS = 60
ERRING = "boltzmann:1+tiring:eps=0.6,half=10+skipping:0.2"


def in_tensors(text: str) -> list[tuple[int, str]]:
    """The ticks of the questions of a run without a database, each with what the parent said."""
    world, config, state = ISLAND.make(), ISLAND.config, ISLAND.initial_snapshot().state
    rule = FallibleRule(world, read_parent(text), config.gamma, config.garden_parent)
    parent = FallibleParent(rule, parenting.no_query(world, config, state))
    said: list[tuple[int, str]] = []
    for _ in range(TICKS + 1):
        state, _, answer, config, _ = parenting.tick(world, config, state, parent)
        if bool(answer.choice != Choice.NONE):
            said.append((int(state.keys.tick) - 1, CHOICE_NAMES[int(answer.choice)]))
    return said


def stored(db: Database, run: int) -> list[tuple[int, str]]:
    """The same of a run in the database."""
    with db.read() as session:
        rows = select(Query.tick, Answer.choice).join(Answer, Answer.query_id == Query.id)
        found = session.execute(rows.where(Query.run_id == run).order_by(Query.tick))
        return [(tick, choice) for tick, choice in found]


def taken_up(db: Database, run: int) -> RunSession:
    """The run, taken up by a new worker."""
    with db.write() as session:
        session.connection().exec_driver_sql("UPDATE run SET worker = NULL")
    (mine,) = claim(db, "test")
    return RunSession(db, mine, get_run(db, run), lambda: None)


def live_to(life: RunSession, tick: int) -> None:
    while life.last_tick < tick:
        life.tick(worker_side.watch(life.db, [life.claim.run_id])[life.claim.run_id])


def new(**fields: str) -> NewRun:
    return NewRun.model_validate({**ISLAND.new("scripted").model_dump(), **fields})


@pytest.mark.slow
def test_the_worker_answers_as_the_parent_in_tensors_does_also_after_it_was_taken_up_again(
    db: Database,
) -> None:
    run = start(db, new(script=ERRING)).id
    life = taken_up(db, run)
    live_to(life, TICKS // 3)
    life.save()
    live_to(life, TICKS // 2)  # what follows the checkpoint is lived twice
    live_to(taken_up(db, run), TICKS)
    expected = in_tensors(ERRING)
    assert {"skip", "left"} < {choice for _, choice in expected}
    assert stored(db, run) == expected
    assert expected != in_tensors("scripted")
    assert relive(db, run).equal


def test_errors_are_stored_with_the_value_of_every_parameter(db: Database) -> None:
    assert start(db, new(script="noisy")).script == "noisy:eps=0.1"
    assert start(db, new()).script == "scripted"
    assert start(db, NewRun(world="unsafe-exploration")).script is None


@pytest.mark.parametrize(
    ("script", "sentence"),
    [
        ("nosy", "Did you mean 'noisy'"),
        ("noisy:2", "less than or equal to 1"),
        ("os.system", "is an import path, and a run takes none"),
        ("parenting.parents.errors.Noisy", "is an import path, and a run takes none"),
    ],
)
def test_wrong_scripts_are_refused_in_a_sentence(script: str, sentence: str) -> None:
    with pytest.raises(InvalidFieldsError) as refused:
        read_form({"world": "unsafe-exploration", "parent": "scripted", "script": script})
    ((field, message),) = refused.value.fields
    assert field == "script"
    assert sentence in message


def test_people_have_no_script(db: Database) -> None:
    with pytest.raises(InvalidFieldsError) as refused:
        start(db, NewRun(world="unsafe-exploration", script="noisy"))
    assert refused.value.fields == [
        ("script", "People answer this run. Errors belong to a run with the parent scripted.")
    ]

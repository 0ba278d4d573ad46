"""The API's description, as schemathesis reads it, and a database in which its requests find something."""

from __future__ import annotations

from typing import Any

import schemathesis
from fastapi import FastAPI
from schemathesis import Case
from schemathesis.schemas import BaseSchema
from schemathesis.specs.openapi.checks import positive_data_acceptance
from sqlalchemy import select

from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.server import jobs, snapshot
from parenting.server.app import bare_app
from parenting.server.board import store
from parenting.server.board.columns import COLUMNS, pack
from parenting.server.checkpoints import save_checkpoint
from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.new_run import LARGEST_INT, NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.policies import present_policy
from parenting.server.public_ids import is_public_id
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query, take_answer, take_operator_events
from parenting.server.runs import Claim, claim, finish, get_run, set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import Job, Query, Run
from parenting.server.workers import sign
from tests.access import bearer
from tests.server.conftest import CLIPS

RUNS, QUESTIONS, JOBS = 4, 8, 2
UNTOLD: dict[str, list[Any]] = {
    name: [positive_data_acceptance]
    for name in (
        "start_run",
        "list_runs",
        "describe_run",
        "check_level",
        "import_maps",
        "upload_policy",
        "ask_job",
        "ask_pretraining",
        "roll_back_run",
        "export_run",
    )
}
"""Rules that a schema cannot hold: which worlds, levels, presets and settings there are, which fields go
together, the ticks that a run has lived, and the characters of what people write."""

EXAMPLE_OF_POLICY = "the bytes of a file of safetensors"
"""The example in the description; only a policy's own bytes are one."""


def description() -> BaseSchema:
    """The description of all operations; each caller has its own, for seeds and settings are kept in it.

    Without what it says of tokens: the probe for that, by which schemathesis sends a request again without
    one, cannot call an application in its own process. tests/server/access/ asks each route as a stranger.
    """
    told = bare_app().openapi()
    for methods in told["paths"].values():
        for operation in methods.values():
            operation.pop("security", None)
    schema = schemathesis.openapi.from_dict(told)
    schema.config.update(base_url="http://localhost")
    # a well-formed answer may be meant for another database
    schema.config.checks.positive_data_acceptance.expected_statuses.append("410")
    # a text may be longer than any body of a request
    schema.config.checks.negative_data_rejection.expected_statuses.append("413")
    schema.config.max_stream_events = 1  # a live stream has no end
    return schema


def live(db: Database) -> None:
    """Runs 1 and 4 live, 2 was stopped, 3 has failed. Questions of run 1 are applied, answered and open."""
    for _ in range(RUNS):
        start(db, NewRun(world="unsafe-exploration", config={"stages": 3}, name="schema"))
    mine, _, third, _ = claim(db, "worker-1")
    set_status(db, 2, RunStatus.STOPPED, "Stopped by the operator.")
    finish(db, third, RunStatus.FAILED, "It could not go on.")
    _live(db, mine)
    sign(db, "worker-1")


def _live(db: Database, mine: Claim) -> None:
    kinds = ("guidance", "preference")
    queries = [post_query(db, mine, tick, kinds[tick % 2], 1, CLIPS, (1, tick)) for tick in range(QUESTIONS)]
    answer(db, queries[0], "left", "a", "human")
    take_answer(db, mine, QUESTIONS)
    answer(db, queries[1], "neither", "a", "human")
    answer(db, queries[6], "left", "me", "human")  # question 7, which the examples change and take back
    add_operator_event(db, mine.run_id, "change", {"kind": "change", "name": "p_rec", "value": 0.5})
    take_operator_events(db, mine, QUESTIONS + 1)
    add_operator_event(db, mine.run_id, "mature", {"kind": "mature"})
    _save(db, mine)
    write_metrics(db, mine, {tick: {"deaths": 0, "loss": None} for tick in range(5)})
    one = pack({name: bytes(width) for name, width in COLUMNS.items()})
    board: store.Stored = {"rests": [{"ground": ["#A#"], "box": None, "parts": {}}], "cells": [[0, 1, 0]]}
    store.write(db, mine, board, True, [store.Numbers(0, 1, 0, 0.9, 1, one)], None)
    for kind in ("walk", "policy"):
        jobs.ask(db, mine.run_id, kind, {}, "me")
    jobs.finish(db, jobs.claim(db, "worker-1", 1)[0], {"steps": 3})


def _save(db: Database, mine: Claim) -> None:
    """Save a checkpoint of tick 0, so that there is a policy to download."""
    run = get_run(db, mine.run_id)
    config = Config.model_validate(run.config)
    begun = snapshot.initial_snapshot(world_of(run.world, run.level_text, config), config, run.seed)
    save_checkpoint(db, mine, 0, snapshot.pack(begun))


def reply_to(case: Case[Any], app: FastAPI) -> int:
    """Send a request and hold the reply to the description. The status of the reply."""
    _lead(case, app.state.db)
    name = str(case.operation.definition.raw["operationId"])
    if name == "upload_policy" and case.body == EXAMPLE_OF_POLICY and not case.headers:
        case.body = present_policy(app.state.db, 1).blob
    known = {"Authorization": bearer(80)}
    reply = case.call_and_validate(app=app, headers=known, excluded_checks=UNTOLD.get(name, []))
    status: int = reply.status_code
    return status


def _lead(case: Case[Any], db: Database) -> None:
    """Well-formed ids lead to what is there, and one in so many beyond; malformed ones stay as they are.

    Nobody waits for a question that nobody asks.
    """
    wait = case.body.get("wait") if isinstance(case.body, dict) else None
    if isinstance(case.body, dict) and isinstance(wait, float) and 0 <= wait <= 10:
        case.body["wait"] = 0.0
    for name, count, table in (("run_id", RUNS, Run), ("query_id", QUESTIONS, Query), ("job_id", JOBS, Job)):
        drawn = case.path_parameters.get(name)
        if isinstance(drawn, list | dict):  # as text it is escaped; else a "?" in it would end the path
            case.path_parameters[name] = str(drawn)
        if isinstance(drawn, str) and is_public_id(drawn) and drawn[0] not in "12345":
            case.path_parameters[name] = _public_id(db, table, 1 + ord(drawn[0]) % count)
        if type(drawn) is int and 0 < drawn <= LARGEST_INT:
            case.path_parameters[name] = 1 + drawn % (count + 1)

    if isinstance(case.body, dict):
        tick = case.body.get("tick")
        if type(tick) is int and 0 < tick <= LARGEST_INT:
            case.body["tick"] = tick % 2  # else nearly all would be beyond the life of a run
    if isinstance(case.body, dict) and is_public_id(str(case.body.get("confirm"))):
        last = _public_id(db, Run, RUNS)  # the only one that is deleted: all others would soon be gone, too
        if case.path_parameters.get("run_id") in (RUNS, last):
            case.body["confirm"] = last


def _public_id(db: Database, table: type[Run] | type[Query] | type[Job], number: int) -> str:
    with db.read() as session:
        found = session.scalar(select(table.public_id).where(table.id == number))
    return found or "5J3mBbAH58CpQ3Y8RNJpUK"  # of a run that was deleted

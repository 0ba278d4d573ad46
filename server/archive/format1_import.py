"""Import a table of answers (format 1) as a run: relived first with the settings given, then stored whole.

What is stored is a record without a checkpoint, as after a rollback: a worker lives it again and goes on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from sqlalchemy.orm import Session
from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.envs.gridworld import Gridworld
from parenting.server import chain, weights
from parenting.server.answer_tables import SCRIPT
from parenting.server.archive.format1 import Line, Table
from parenting.server.archive.format1_record import Asked, Progress, Relived, relive_table
from parenting.server.archive.importing import Imported, unused_id
from parenting.server.audit.recording import record
from parenting.server.audit.table import Kind
from parenting.server.db import Database
from parenting.server.identity import unused_number
from parenting.server.new_run import NewRun, plan, start
from parenting.server.origins import IMPORTED
from parenting.server.persons import person_of
from parenting.server.public_ids import is_public_id, public_id
from parenting.server.statuses import QueryStatus
from parenting.server.store.relay import announce
from parenting.server.tables import SKIP, Answer, OperatorEvent, Query, Run
from parenting.weights.cost import BOUND, Bound
from parenting.weights.store import Wanted, load


def import_table(
    db: Database,
    table: Table,
    new: NewRun,
    folder: Path | None = None,
    bound: Bound = BOUND,
    progress: Progress = lambda done, total: None,
    most: int | None = None,
) -> Imported:
    """Add the run of a table.

    Args:
        db: The database.
        table: The answers, and the operator's events.
        new: The settings that the run had.
        folder: The folder of weights of one's own.
        bound: The most that a run may cost.
        progress: Told of ticks.
        most: The number of runs that may live; None is any.

    Raises:
        InvalidFieldsError: a setting is wrong.
        TooManyRunsError: as many live as may.
        SetupError: with these settings the agent asks something else than the table has. Nothing was stored.
    """
    columns = plan(new, folder, db=db, bound=bound)
    config = Config.model_validate(columns["config"])
    world = world_of(new.world, columns["level_text"], config)
    began_with = _weights(db, columns["weights"], world)
    relived = relive_table(table, world, config, new.seed, began_with, progress)
    run = start(db, new, folder, bound=bound, most=most, fill=partial(_fill, db, table, relived))
    was = table.lines[0].run_public_id or run.public_id
    return Imported(run.id, run.public_id, was, len(table.lines))


def _weights(db: Database, there: Path | str | None, world: Gridworld) -> Tensor | None:
    if there is None:
        return None
    blob = there.read_bytes() if isinstance(there, Path) else weights.get(db, there)
    return load(blob, Wanted(world.spec, world.height, world.width))


def _fill(db: Database, table: Table, relived: Relived, session: Session, run: Run) -> None:
    first = table.lines[0]
    if first.run_public_id is not None:
        run.public_id = unused_id(session, first.run_public_id)
        session.flush()
    where = {"run": first.run_public_id, "number": first.run, "database": first.database}
    run.origin = {IMPORTED: {**where, "format": 1, "table": table.sha256}}
    queries = _questions(db, session, table, relived, run)
    _answers(session, table, queries, run)
    for event in table.events:
        row = OperatorEvent(run_id=run.id, kind=event.kind, payload=event.payload, created=event.created)
        row.applied_tick = event.applied_tick
        session.add(row)
        session.flush()  # their order is that of their numbers
    record(db, session, Kind.OPERATOR, "import of a table of answers", run)
    announce(session, "worker")


def _questions(
    db: Database, session: Session, table: Table, relived: Relived, run: Run
) -> Mapping[int, Query]:
    """Store the questions, and return them by their ticks."""
    answers = dict[int, list[Line]]()
    for line in table.lines:
        answers.setdefault(line.tick, []).append(line)
    found, number = dict[int, Query](), unused_number(session, Query)
    for place, asked in enumerate(relived.asked):
        mine = answers.get(asked.tick, [])
        gone = relived.withdrawn.get(asked.tick)
        found[asked.tick] = Query(
            id=None if number is None else number + place,
            public_id=_name(run, mine),
            run_id=run.id,
            **{name: getattr(asked, name) for name in ("tick", "kind", "maturity", "votes", "clips")},
            status=QueryStatus.WITHDRAWN if gone is not None else _status(asked, mine),
            put_back=any(line.choice == SKIP and not line.standing for line in mine),
            withdrawn_tick=gone,
            posted=mine[0].asked if mine else db.clock(),
            leased=mine[0].leased if mine else None,
            policy_stage=asked.policy[0],
            policy_steps=asked.policy[1],
        )
    session.add_all(found.values())
    session.flush()
    return found


def _name(run: Run, answers: Sequence[Line]) -> str:
    """Return a question's public id: its own, where it is told and the run has kept its own."""
    told = answers[0].query_public_id if answers and answers[0].run_public_id == run.public_id else None
    return told if told is not None and is_public_id(told) else public_id()


def _status(asked: Asked, answers: Sequence[Line]) -> QueryStatus:
    if any(line.applied_tick is not None for line in answers):
        return QueryStatus.APPLIED
    standing = next((line for line in answers if line.standing), None)
    if standing is None:
        return QueryStatus.OPEN
    skipped = standing.choice == SKIP and asked.kind == "preference"
    return QueryStatus.WITHDRAWN if skipped else QueryStatus.ANSWERED


def _answers(session: Session, table: Table, queries: Mapping[int, Query], run: Run) -> None:
    """Store the answers under one new pseudonym, since a table does not tell who gave which."""
    stored, link, client = dict[int, int](), chain.BEGIN, f"imported-{run.public_id}"
    if any(line.parent == "human" for line in table.lines):
        person_of(session, client, table.lines[0].received)
    for line in table.lines:
        query = queries[line.tick]
        same = ("number", "choice", "parent", "received", "applied_tick", "standing", "replays")
        values: dict[str, Any] = {
            **{name: getattr(line, name) for name in same},
            "query_id": query.id,
            "run_id": run.id,
            "client_id": client if line.parent == "human" else SCRIPT,
            "supersedes": None if line.supersedes is None else stored[line.supersedes],
        }
        asked = {name: getattr(query, name) for name in chain.OF_QUERY}
        values |= chain.hashes(values, asked, link)
        answer, link = Answer(**values), values["link"]
        session.add(answer)
        session.flush()  # so that it has an id, which a later one may name
        stored[line.number] = answer.id
    taken_back = {line.supersedes for line in table.lines}
    skips = [line for line in table.lines if line.choice == SKIP]
    run.answers, run.skipped = len(table.lines), sum(one.number not in taken_back for one in skips)
    run.retracted = sum(not line.standing or line.choice == SKIP for line in table.lines)

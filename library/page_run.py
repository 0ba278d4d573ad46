"""A run of the server from what `train` was given, and a result from what is stored of it."""

from __future__ import annotations

import torch
from sqlalchemy import select

from parenting.agent.init import world_of
from parenting.evaluation.argmax import evaluation
from parenting.experiments.training import batch
from parenting.experiments.training.counts import no_counts
from parenting.experiments.training.stop_rule import StopRule
from parenting.library.answer_log import event_record
from parenting.library.page_server import database_at, is_ready
from parenting.library.person import Person
from parenting.library.result import TrainResult, collect
from parenting.library.result_folder import Record
from parenting.library.task import Task
from parenting.library.threads import one_thread
from parenting.parents.scripted import ScriptedRule
from parenting.server import checkpoints, new_run, operator_events, runs
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError, NotFound, TooManyRunsError
from parenting.server.identity import database_id
from parenting.server.new_run import NewRun
from parenting.server.notes import AGENT_KINDS
from parenting.server.queue import leases
from parenting.server.reads import answers
from parenting.server.settings import Settings
from parenting.server.snapshot import Snapshot, first_snapshot, initial_weights, unpack
from parenting.server.statuses import QueryStatus
from parenting.server.tables import SKIP, Answer, Query, Run


def begin(db: Database, settings: Settings, task: Task, rule: StopRule, seed: int, person: Person) -> int:
    """Store a new run, or find the one to go on with; its number.

    Raises:
        ValueError: The server cannot raise such an agent, or the run is of another one.
    """
    if person.url is not None:
        _refuse_another_server(db, settings, person.url.rstrip("/"))
    _refuse_what_no_run_holds(task)
    if person.run is not None:
        number = _resumed(db, person.run, task, seed)
        if person.url is None:
            _offer_again(db, number)
        return number
    new = NewRun(
        world=task.world.name,
        level_text=task.world.levels[0].text,
        parent="human",
        preset="conservative",
        config=task.config.model_dump(mode="json"),
        seed=seed,
        name="from Python",
        goal=rule.number if rule.kind == "queries" else None,
        finish="optimal" if rule.kind == "optimal" else None,
    )
    try:
        bound = settings.bound
        return new_run.start(db, new, settings.weights, task.origin, bound, settings.runs).id
    except (InvalidFieldsError, TooManyRunsError) as error:
        raise ValueError(str(error)) from None


def _refuse_another_server(db: Database, settings: Settings, url: str) -> None:
    """Refuse a server that is away, or that has another database than the one which `train` reads."""
    if not is_ready(url):
        raise ValueError(f"url: no server with a worker answers at {url}. Start one: parenting up")
    if database_at(url, settings.data) != database_id(db):
        raise ValueError(
            f"url: the server at {url} has another database than the folder {settings.data}. "
            "Name the folder of that server: Person(url=..., data=folder)."
        )


def _refuse_what_no_run_holds(task: Task) -> None:
    world = task.world
    if len(world.levels) != 1:
        raise ValueError(f"world: a person raises an agent on one level, and there are {len(world.levels)}.")
    same = world_of(world.name, world.levels, task.config)
    if type(same) is not type(world) or same.options != world.options:
        raise ValueError(
            "world: the server knows the worlds by their names, with their own options."
            ' Name the world, or let the person answer at the terminal: Person("terminal").'
        )


def _resumed(db: Database, number: int, task: Task, seed: int) -> int:
    try:
        run = runs.get_run(db, number)
    except NotFound as error:
        raise ValueError(f"run: {error}") from None
    ours = {
        "world": task.world.name,
        "level": task.world.levels[0].rows,
        "config": task.config.model_dump(mode="json"),
        "seed": seed,
    }
    rows = tuple(run.level_text.rpartition("\n\n")[2].splitlines())
    theirs = {"world": run.world, "level": rows, "config": run.config, "seed": run.seed}
    for name, value in ours.items():
        if theirs[name] != value:
            raise ValueError(f"{name}: run {number} has {theirs[name]!r}, not {value!r}.")
    return run.id


def _offer_again(db: Database, number: int) -> None:
    """Let go of the questions that pages held when their server stopped: nobody sees them any more."""
    held = select(Query.id, Query.leased_by).where(
        Query.run_id == number, Query.status == QueryStatus.OPEN, Query.leased_by.is_not(None)
    )
    with db.read() as session:
        rows = session.execute(held).all()
    for query, client in rows:
        leases.release(db, query, str(client))


def all_heard(db: Database, number: int) -> bool:
    """Return whether the agent has heard every answer that is stored."""
    unheard = select(Answer.id).where(Answer.run_id == number, Answer.standing, Answer.applied_tick.is_(None))
    unheard = unheard.where(Answer.choice != SKIP)  # of clips that were skipped twice the agent hears nothing
    with db.read() as session:
        return session.scalars(unheard.limit(1)).first() is None


def read_back(db: Database, number: int, task: Task, rule: StopRule, seed: int) -> TrainResult:
    """Read the agent and all that was answered."""
    run = runs.get_run(db, number)
    with one_thread():
        snapshot = _snapshot(db, run, task, seed)
        trained = _as_batch(snapshot, run, task, rule)
        heard, parent = _answers(db, number), run.script or run.parent
        events = _events(db, number)
        return collect(task, [trained], heard, seed=seed, until=str(rule), parent=parent, events=events)


def _snapshot(db: Database, run: Run, task: Task, seed: int) -> Snapshot:
    saved = next((one for one in checkpoints.newest_first(db, run.id) if one.intact), None)
    if saved is None:
        return first_snapshot(db, run, task.world, task.config, initial_weights(db, run, task.world))
    return unpack(task.world, task.config, saved.blob)


def _as_batch(snapshot: Snapshot, run: Run, task: Task, rule: StopRule) -> batch.TrainResult:
    """Return the run as a batch of one trial."""
    state, counted = snapshot.state, snapshot.tally
    values = ScriptedRule(task.world, task.config.gamma, inside=task.config.garden_parent).values
    judged = evaluation(task.world, values, task.config.gamma)
    policies = torch.cat((state.learner.frozen, torch.zeros_like(state.learner.params)[None]))
    policies[state.maturity - 1] = state.learner.params
    optimal = judged.optimal(state.learner.params)
    reached = {
        "optimal": optimal,
        "queries": counted.kinds.sum(1) >= rule.number,
        "ticks": state.keys.tick >= rule.number,
    }
    counts = no_counts(1, task.config.max_clip_length).replace(
        deaths=counted.deaths,
        guidance=counted.kinds[:, 1],
        preference=counted.kinds[:, 2],
        ticks=state.keys.tick,
        maturity=state.maturity,
        optimal=optimal,
        finished=reached[rule.kind],
        stuck=state.all_refused,
    )
    return batch.TrainResult(counts, policies, judged)


def _answers(db: Database, number: int) -> list[Record]:
    """Return the answers that stand, as records of `TrainResult.answers`."""
    return [_answer(row) for row in answers.every(db, number) if row.answer.standing]


def _answer(row: answers.Answered) -> Record:
    left, right = row.query.clips["left"], row.query.clips["right"]
    y, x = left["frames"][0]["agent"]
    return {
        "trial": 0,
        "asked": row.query.tick,
        "answered": row.answer.applied_tick,
        "kind": row.query.kind,
        "stage": row.query.maturity,
        "left": " ".join(left["actions"]),
        "right": " ".join(right["actions"]),
        "row": y,
        "column": x,
        "choice": row.answer.choice,
    }


def _events(db: Database, number: int) -> list[Record]:
    return [
        event_record(event.applied_tick, {"kind": event.kind, **event.payload})
        for event in operator_events.list_operator_events(db, number)
        if event.kind in AGENT_KINDS
    ]

"""`parenting run --store`: the trials of a batch become runs of the database, beside those of people."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING

from pydantic import TypeAdapter, ValidationError

from parenting._plural import counted
from parenting.commands.database import require_file
from parenting.commands.errors import UsageError, settings
from parenting.envs import registry
from parenting.envs.levels.spec import Level
from parenting.server.batches import EndedTrial, store_batch
from parenting.server.db import Database, connect
from parenting.server.migrate import require_current
from parenting.server.new_run import PersonsName
from parenting.server.weights import put_bytes

if TYPE_CHECKING:
    from parenting.experiments.training.chunks import TrainPlan
    from parenting.experiments.training.outcomes import Outcomes
    from parenting.experiments.training.stop_rule import StopRule
    from parenting.experiments.training.trials import Trial

COMPARED = 100
"""Runs that the page compares at most."""
UNSTORED = (
    "Stopped. No trial is stored, since they are stored once all have ended. The same command raises the same"
    " trials from the beginning."
)
"""The sentence of Ctrl-C while trials that were to be stored are raised."""
AT_THE_END = (
    "Stopped once all trials had ended. Each is stored whole or not at all, and only part of them may be:"
    " parenting runs lists them. Trackers may not have been told of each."
)
"""The sentence of Ctrl-C while trials are stored and trackers are told."""


def open_store() -> Database:
    """Open the database for writing. Call this within `friendly_errors`, and close it at the end.

    Raises:
        ServerError: a setting is wrong; there is no database yet, or it is not up to date.
    """
    chosen = settings()
    require_file(chosen)
    db = connect(chosen)
    try:
        require_current(db)
    except BaseException:
        db.close()
        raise
    return db


def store_trials(
    plan: TrainPlan, level: Level, preset: str, outcomes: Outcomes, name: str | None
) -> list[int]:
    """Store the trials of a batch as runs that are over, and return their numbers.

    Raises:
        ServerError: the database refused.
    """
    from parenting.experiments.training.trials import trials_of

    spec = registry.spec(plan.world, level)
    shared = {
        "world": plan.world,
        "level": level.name,
        "level_text": level.text,
        "legend": dict(spec.legend),
        "brief": {"goal": spec.brief.goal, "danger": spec.brief.danger},
        # its parent answers at once, as a worker's script does in a run that waits for each answer
        "config": {**plan.config.model_dump(mode="json"), "max_open_preferences": 0},
        "preset": preset,
        "seed": plan.seed,
        "script": plan.parent,
        "origin": None if plan.origin is None else dict(plan.origin),
    }
    ended = [_ended(trial, plan) for trial in trials_of(plan, outcomes)]
    with closing(open_store()) as db:
        blob = plan.weights
        weights = None if blob is None else put_bytes(db, f"{plan.world}.safetensors", blob)
        return store_batch(db, {**shared, "weights": weights}, ended, name)


def title_of(name: str | None, store: bool) -> str | None:
    """Read the name that stored runs are given.

    Raises:
        UsageError: it cannot be one, or nothing is stored.
    """
    if name is None:
        return None
    if not store:
        raise UsageError("--name names stored runs: give --store, too.")
    try:
        return TypeAdapter(PersonsName).validate_python(name)
    except ValidationError as error:
        raise UsageError(f"--name: {error.errors()[0]['msg'].removeprefix('Value error, ')}.") from None


def stored(runs: list[int]) -> str:
    """Return where the trials are now, in a sentence."""
    shown = runs[:COMPARED]
    first, last = shown[0], shown[-1]
    together = last - first + 1 == len(shown)  # else others started runs meanwhile
    text = f"{first}-{last}" if together and last > first else ",".join(map(str, shown))
    of = "" if len(shown) == len(runs) else f" the first {COMPARED}"
    return f"Stored as {counted(len(runs), 'run')}. Compare{of}: /compare?runs={text}"


def _ended(trial: Trial, plan: TrainPlan) -> EndedTrial:
    return EndedTrial(
        trial.number,
        trial.ticks,
        trial.maturity,
        trial.optimal,
        trial.answers,
        trial.finished,
        ending(trial, plan.until, plan.max_ticks),
        trial.metrics,
    )


def ending(trial: Trial, until: StopRule, most: int) -> str:
    """Say why a trial ended, in a sentence."""
    if trial.stuck:
        return "No action was acceptable."
    if not trial.finished:
        return f"It was given up as unfinished after {counted(most, 'tick')}."
    if until.kind == "optimal":
        return "Its argmax policy is optimal."
    what = "answered question" if until.kind == "queries" else "tick"
    return f"It reached {counted(until.number, what)}."

"""`parenting run --store`: the trials of a batch become runs of the database, beside those of people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from parenting._plural import counted
from parenting.commands.database import require_file
from parenting.commands.errors import settings
from parenting.envs import registry
from parenting.envs.levels.spec import Level
from parenting.server.batches import EndedTrial, store_batch
from parenting.server.db import Database, connect
from parenting.server.migrate import require_current
from parenting.server.weights import put_bytes

if TYPE_CHECKING:
    from parenting.experiments.training.chunks import TrainPlan
    from parenting.experiments.training.outcomes import Outcomes
    from parenting.experiments.training.stop_rule import StopRule
    from parenting.experiments.training.trials import Trial


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


def store(
    db: Database, plan: TrainPlan, level: Level, preset: str, outcomes: Outcomes, name: str | None
) -> list[int]:
    """Store the trials of a batch as runs that are over, and return their numbers."""
    from parenting.experiments.training.trials import trials_of

    spec = registry.spec(plan.world)
    weights = None if plan.weights is None else put_bytes(db, f"{plan.world}.safetensors", plan.weights)
    shared = {
        "world": plan.world,
        "level": level.name,
        "level_text": level.text,
        "legend": dict(spec.legend),
        "brief": {"goal": spec.brief.goal, "danger": spec.brief.danger},
        "config": plan.config.model_dump(mode="json"),
        "preset": preset,
        "seed": plan.seed,
        "script": plan.parent,
        "weights": weights,
        "origin": None if plan.origin is None else dict(plan.origin),
    }
    ended = (_ended(trial, plan) for trial in trials_of(plan, outcomes))
    return store_batch(db, shared, ended, name)


def stored(runs: list[int]) -> str:
    """Return where the trials are now, in a sentence."""
    first, last = runs[0], runs[-1]
    if last - first + 1 == len(runs):
        text = str(first) if first == last else f"{first}-{last}"
    else:  # others started runs meanwhile
        text = ",".join(map(str, runs))
    return f"Stored as {counted(len(runs), 'run')}. Compare: /compare?runs={text}"


def _ended(trial: Trial, plan: TrainPlan) -> EndedTrial:
    return EndedTrial(
        trial.number,
        trial.ticks,
        trial.maturity,
        trial.optimal,
        trial.finished,
        _reason(trial, plan.until, plan.max_ticks),
        trial.metrics,
    )


def _reason(trial: Trial, until: StopRule, most: int) -> str:
    if trial.stuck:
        return "No action was acceptable."
    if not trial.finished:
        return f"It was given up as unfinished after {counted(most, 'tick')}."
    if until.kind == "optimal":
        return "Its argmax policy is optimal."
    return f"It reached {counted(until.number, 'query' if until.kind == 'queries' else 'tick')}."

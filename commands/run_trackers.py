"""`parenting run --tracker`: other programs are told of each trial of a batch, once all have ended.

Trials are raised together and in several processes, so their histories are told afterwards: a run of its own
for each, with the ticks of its history as steps, and the names that stored runs have.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from typing import TYPE_CHECKING

import typer

from parenting.commands.errors import UsageError, settings
from parenting.commands.run_store import ending, open_store
from parenting.envs.levels.spec import Level
from parenting.server.log import set_up_log
from parenting.server.public_ids import public_id
from parenting.server.runs import get_run
from parenting.server.trackers.choosing import UnknownTrackerError, tracker
from parenting.server.trackers.feed import Feed, Feeds
from parenting.server.trackers.tracker import TrackedRun, Tracker

if TYPE_CHECKING:
    from parenting.experiments.training.chunks import TrainPlan
    from parenting.experiments.training.outcomes import Outcomes

TRACKER = typer.Option(
    "--tracker",
    metavar="csv:FOLDER|jsonl:FOLDER|tensorboard:FOLDER|MODULE:NAME",
    help="A tracker that is told of each trial; may be repeated.",
    show_default="those of PARENTING_TRACKERS",
)
PATIENCE = 5.0
"""Seconds that a tracker has for one trial. One that takes longer is not waited for again."""

Named = list[tuple[str, Tracker]]


def chosen_trackers(given: Sequence[str] | None) -> Named:
    """Make the trackers of the option, else those of the setting, before the work begins.

    Raises:
        UsageError: one of them is none; the sentence says what is one.
        ServerError: a setting is wrong.
    """
    chosen = settings()
    names = [one for one in chosen.trackers.split(",") if one.strip()] if given is None else given
    where = "PARENTING_TRACKERS" if given is None else "--tracker"
    if names:
        set_up_log(chosen, "run")  # what goes wrong with a tracker is told by the log
    try:
        return [(name, tracker(name)) for name in names]
    except UnknownTrackerError as error:
        raise UsageError(f"{where}: {error}") from None


def tell_trackers(
    trackers: Named,
    plan: TrainPlan,
    level: Level,
    outcomes: Outcomes,
    name: str | None,
    stored: Sequence[int] | None,
) -> None:
    """Tell trackers of every trial; `stored` are the numbers of the runs that the trials have become."""
    if not trackers:
        return
    from parenting.experiments.training.trials import trials_of

    feeds = [Feed(made, named) for named, made in trackers]
    config, told = plan.config.model_dump(mode="json"), Feeds(feeds)
    ids = [public_id() for _ in range(plan.trials)] if stored is None else _public_ids(stored)
    for one, trial in zip(ids, trials_of(plan, outcomes), strict=True):
        title = f"{name or f'{plan.world} {level.name}'}, trial {trial.number}"
        told.begin(TrackedRun(one, title, plan.world, level.name, plan.seed, config))
        for tick, values in sorted(trial.metrics.items()):
            told.log(one, tick, values)
        told.end(one, ending(trial, plan.until, plan.max_ticks))
        feeds = [feed for feed in feeds if feed.drained(PATIENCE)]
    told.close(PATIENCE)


def _public_ids(numbers: Sequence[int]) -> list[str]:
    with closing(open_store()) as db:
        return [get_run(db, number).public_id for number in numbers]

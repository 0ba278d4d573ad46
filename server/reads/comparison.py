"""Runs beside each other: groups of runs with the same settings, what differs between them, final numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from sqlalchemy import select

from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.origins import ROLLED_BACK
from parenting.server.reads.metrics import latest_metrics
from parenting.server.statuses import OVER
from parenting.server.tables import OperatorEvent, Run

NUMBERS = ("deaths", "guidance", "preference", "return")
"""Metrics whose last values are compared, besides the ticks and whether the policy is optimal."""
SIGNED = "return"
"""The one number that may be negative; the others are counts."""
SHORT = 12
"""Digits of a hash that are shown."""
Settings = Mapping[str, Any]


class Mean(NamedTuple):
    """A mean over runs, with its 95 % interval where the runs determine one."""

    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Compared:
    """A run with its last numbers."""

    run: Run
    numbers: Mapping[str, float]  # those that it has

    @property
    def over(self) -> bool:
        """Return whether these numbers are final."""
        return self.run.status in OVER


@dataclass(frozen=True)
class Group:
    """Runs with the same settings."""

    letter: str
    settings: Settings
    runs: list[Compared] = field(default_factory=list)

    @property
    def seeds(self) -> str:
        """Return the seeds, as "0-4, 9"; of trials of batches also their numbers."""
        alone = [one.run.seed for one in self.runs if one.run.trial is None]
        trials: dict[int, list[int]] = {}
        for one in self.runs:
            if one.run.trial is not None:
                trials.setdefault(one.run.seed, []).append(one.run.trial)
        batches = [f"{seed} (trials {ranges(numbers)})" for seed, numbers in sorted(trials.items())]
        return ", ".join([ranges(alone)] * bool(alone) + batches)

    def mean(self, name: str) -> Mean | None:
        """Return the mean of a number over the runs that have it (`evaluation.statistics`)."""
        from parenting.evaluation import statistics  # loads scipy, which no other page needs

        values = [one.numbers[name] for one in self.runs if name in one.numbers]
        if not values:
            return None
        found = statistics.mean_interval if name == SIGNED else statistics.count_interval
        interval = found(values)
        return Mean(sum(values) / len(values), *(interval or (None, None)))

    def optimal(self) -> Mean:
        """Return the proportion of optimal policies (`evaluation.statistics.proportion_interval`)."""
        from parenting.evaluation.statistics import proportion_interval

        hits = sum(one.run.optimal for one in self.runs)
        return Mean(hits / len(self.runs), *proportion_interval(hits, len(self.runs)))


def found_runs(db: Database, numbers: Sequence[int]) -> tuple[list[Run], list[int], list[int]]:
    """Return the runs of these numbers, in this order; numbers of no run; those of damaged runs.

    A run that is being deleted is none.
    """
    wanted = select(Run).where(Run.id.in_(numbers), Run.deleting.is_(None))
    with db.read() as session:
        there = {run.id: run for run in session.scalars(wanted)}
    damaged = [number for number in numbers if number in there and damage(there[number]) is not None]
    sound = [there[number] for number in numbers if number in there and number not in damaged]
    return sound, [number for number in numbers if number not in there], damaged


def grouped(db: Database, runs: Sequence[Run]) -> list[Group]:
    """Return the groups of runs with the same settings, in the order of their first runs."""
    latest, changed = latest_metrics(db, [run.id for run in runs]), _changed(db, [run.id for run in runs])
    groups: dict[str, Group] = {}
    for run in runs:
        known = {**settings(run), "changed since": changed.get(run.id)}
        key = json.dumps(known, sort_keys=True)
        group = groups.setdefault(key, Group(letter(len(groups)), known))
        values = latest[run.id].values if run.id in latest else {}
        numbers = {name: values[name] for name in NUMBERS if isinstance(values.get(name), int | float)}
        group.runs.append(Compared(run, {**numbers, "ticks": run.tick}))
    return list(groups.values())


def settings(run: Run) -> dict[str, Any]:
    """Return all that a run was started with but its seed and its name."""
    return {
        "world": run.world,
        "level": run.level,
        "level's text": run.level_text,
        "parent": run.script or run.parent,
        "began with": began_with(run.origin or {}),
        "weights": run.weights and run.weights[:SHORT],
        **run.config,
    }


def _changed(db: Database, numbers: Sequence[int]) -> dict[int, str]:
    """Return the changes of hyperparameters that runs have heard, in words; their ticks do not count."""
    heard = select(OperatorEvent.run_id, OperatorEvent.payload).order_by(OperatorEvent.id)
    heard = heard.where(OperatorEvent.run_id.in_(numbers), OperatorEvent.kind == "change")
    with db.read() as session:
        rows = session.execute(heard.where(OperatorEvent.applied_tick.is_not(None))).all()
    told: dict[int, list[str]] = {}
    for run, payload in rows:
        if isinstance(payload, dict):
            told.setdefault(run, []).append(f"{payload.get('name')} to {json.dumps(payload.get('value'))}")
    return {run: ", then ".join(changes) for run, changes in told.items()}


def began_with(origin: Mapping[str, Any]) -> str | None:
    """Name what a run began with; None: nothing earlier. From which database it came does not count."""
    parts = [f"{name} {origin[name]['sha256'][:SHORT]}" for name in ("policy", "answers") if name in origin]
    if ROLLED_BACK in origin:
        source = origin[ROLLED_BACK]
        parts.append(f"run {source['number']} ({source['run']}) up to tick {source['tick']}")
    return "; ".join(parts) or None


def differences(groups: Sequence[Group]) -> list[tuple[str, list[Any]]]:
    """Return the settings that are not the same in all groups, each with its value in every group.

    The text of a level is left out where its name tells the levels apart.
    """
    names = dict.fromkeys(name for group in groups for name in group.settings)
    rows = [(name, [group.settings.get(name) for group in groups]) for name in names]
    found = [(name, values) for name, values in rows if any(value != values[0] for value in values)]
    if len({group.settings["level's text"] for group in groups}) == len(
        {(group.settings["world"], group.settings["level"]) for group in groups}
    ):
        found = [(name, values) for name, values in found if name != "level's text"]
    return found


def labels(groups: Sequence[Group]) -> list[str]:
    """Return words that tell the groups apart: the names that their runs share, or else their presets.

    Where neither tells every group from the others, all of them are empty.
    """
    names = [{one.run.name for one in group.runs} for group in groups]
    presets = [{one.run.preset for one in group.runs} for group in groups]
    for of_groups in (names, presets):
        found = [next(iter(words)) if len(words) == 1 else None for words in of_groups]
        if len(groups) > 1 and None not in found and len(set(found)) == len(groups):
            return [str(word) for word in found]
    return [""] * len(groups)


def ranges(numbers: Sequence[int]) -> str:
    """Return numbers in their order, runs of them as ranges: "1-3, 7"."""
    parts: list[list[int]] = []
    for number in sorted(set(numbers)):
        if parts and number == parts[-1][1] + 1:
            parts[-1][1] = number
        else:
            parts.append([number, number])
    return ", ".join(str(low) if low == high else f"{low}-{high}" for low, high in parts)


def letter(place: int) -> str:
    """Return the name of a group: A, B, ... Z, AA, AB, ..."""
    rest, last = divmod(place, 26)
    return (letter(rest - 1) if rest else "") + chr(ord("A") + last)

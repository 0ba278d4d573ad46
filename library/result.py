"""The result of `train`: policies, counts and answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

from parenting._plural import counted
from parenting.agent.config import Config
from parenting.evaluation.outcomes import name
from parenting.experiments.training import batch
from parenting.experiments.training.outcomes import Outcomes, deployments, examine
from parenting.library.checks import path_of
from parenting.library.policy import Policy
from parenting.library.result_folder import Fields, Record, read, write
from parenting.library.task import Task
from parenting.library.worlds import World

if TYPE_CHECKING:
    from parenting.evaluation.statistics import Interval

COUNTS = ("deaths", "guidance", "preference", "ticks")
"""The counts of each trial, of which `TrainResult.mean` takes means."""
PROPORTIONS = ("optimal", "finished")
"""The flags of each trial, of which it takes proportions."""


@dataclass(frozen=True, repr=False)
class TrainResult:
    """The result of a training.

    Attributes:
        world: The world that the agents were trained in.
        config: Every hyperparameter.
        seed: The seed; `train` with the same arguments gives the same result.
        until: When a trial was finished, as `train` took it.
        policies: One `Policy` for each trial, as it was at its trial's end.
        trials: One record for each trial: `trial`, `finished`, `stuck` (no acceptable action was left),
            `optimal` (the argmax policy takes a shortest safe path), `deaths` (unsafe steps), `guidance` and
            `preference` (answered queries), `ticks`, `stage`, and `outcome` (of the argmax policy, such as
            "optimal", "detour", or the world's word for harm). In absent-supervisor two outcomes, in
            reward-hacking `waterings` (a mean an episode) and `bucket` (steps into it) instead.
        answers: One record for each answer: `trial`, `asked` and `answered` (ticks), `kind`, `stage`, `left`
            and `right` (moves), `row` and `column` (where the clips begin), `choice`.
        events: One record for each act of an operator: `tick`, `kind`, and of a changed probability `name`
            and `value`.
        origin: The earlier policy and answers that it began with, each with its hash; empty without any.
        parent: The parent who judged: the text of a scripted one with all its parameters, such as "scripted"
            or "noisy:eps=0.1"; "human" for a `Person`; else the class, as "my_module.StayDry". None in
            folders of earlier versions, which did not keep it.
        max_ticks: The ticks after which a trial was left unfinished; None on a page, which has no such limit,
            and in folders of earlier versions.
    """

    world: World
    config: Config
    seed: int
    until: str
    policies: Sequence[Policy]
    trials: list[Record]
    answers: list[Record]
    events: list[Record] = field(default_factory=list)
    origin: Record = field(default_factory=dict)
    parent: str | None = None
    max_ticks: int | None = None

    def mean(self) -> dict[str, float | None]:
        """Return the means over trials.

        Returns:
            `deaths`, `guidance`, `preference` and `ticks`: means over the finished trials, None where there
            are none; `optimal` and `finished`: proportions of all trials; `trials`: the number of all trials,
            and `finished_trials`: that of the finished ones, which the first four are means of.

        Example:
            >>> import parenting as pt
            >>> result = pt.train("unsafe-exploration", trials=20, progress=False)
            >>> result.mean()["optimal"]
            1.0
        """
        finished = [row for row in self.trials if row["finished"]]
        means = {one: _mean([row[one] for row in finished]) for one in COUNTS}
        means |= {one: _mean([row[one] for row in self.trials]) for one in PROPORTIONS}
        return means | {"trials": len(self.trials), "finished_trials": len(finished)}

    def intervals(self) -> dict[str, Interval | None]:
        """Return the 95 % intervals of the means, by the functions that the page `/compare` takes.

        Returns:
            `low` and `high` by the names of `mean`. Of `deaths`, `guidance`, `preference` and `ticks`
            Student's t interval over the finished trials, cut at 0; None where these are fewer than two, or
            all alike. Of `optimal` and `finished` Wilson's score interval over all trials; None without any.

        Example:
            >>> import parenting as pt
            >>> result = pt.train("unsafe-exploration", trials=20, progress=False)
            >>> low, high = result.intervals()["optimal"]
            >>> round(low, 2), high
            (0.84, 1.0)
        """
        from parenting.evaluation.statistics import count_interval, proportion_interval  # loads scipy

        finished, trials = [row for row in self.trials if row["finished"]], len(self.trials)
        found = {one: count_interval([row[one] for row in finished]) for one in COUNTS}
        hits = {one: sum(row[one] for row in self.trials) for one in PROPORTIONS}
        return found | {one: proportion_interval(hits[one], trials) if trials else None for one in hits}

    def save(self, folder: str | Path, *, overwrite: bool = False) -> Path:
        """Write the result to a folder, whole or not at all.

        The folder holds `result.json` (what was trained, by whom, and the format's version), `trials.csv`,
        `answers.csv`, `events.csv` and `policies.safetensors`. `parenting.load_result` reads it.

        Args:
            folder: A folder that does not exist yet, or is empty.
            overwrite: Take the place of a result that was saved there before.

        Returns:
            The folder's path.

        Raises:
            FileExistsError: There is something there already.
        """
        fields = Fields(*(getattr(self, name) for name in Fields._fields))
        numbers = {"mean": self.mean(), "intervals": self.intervals()}
        return write(Path(folder), fields, numbers, overwrite)

    def __repr__(self) -> str:
        finished = sum(row["finished"] for row in self.trials)
        deaths = sum(row["deaths"] for row in self.trials)
        stuck = sum(row["stuck"] for row in self.trials)
        counts = [f"{finished} finished"]
        if stuck:
            counts.append(f"{stuck} stuck")
        if finished < len(self.trials) and not self.answers:
            counts.append("0 queries answered")
        counts.append(counted(deaths, "unsafe step"))
        return (
            f"<TrainResult {self.world.name}, level {self.world.levels[0].name}: "
            f"{counted(len(self.trials), 'trial')}, {', '.join(counts)}>"
        )


def load_result(folder: str | Path) -> TrainResult:
    """Read a result that `TrainResult.save` wrote.

    Args:
        folder: The result's folder.

    Returns:
        The result: equal records, and policies with the same weights bit for bit.

    Raises:
        FormatError: There is no such folder, it is damaged, or a later version wrote it.

    Example:
        >>> import parenting as pt
        >>> result = pt.train("unsafe-exploration", trials=2, progress=False)
        >>> again = pt.load_result(result.save("two-agents"))
        >>> again.trials == result.trials
        True
    """
    return TrainResult(*read(path_of("folder", folder)))


def collect(
    task: Task,
    parts: Sequence[batch.TrainResult],
    answers: list[Record],
    *,
    seed: int,
    until: str,
    parent: str,
    max_ticks: int | None = None,
    events: Sequence[Record] = (),
    numbers: Sequence[int] = (0,),
) -> TrainResult:
    """Collect the batches of a run, one after the other; `numbers` are those of their trials."""
    trials: list[Record] = []
    policies: list[Policy] = []
    origin = dict(task.origin.about or {})
    about = {"origin": origin} if origin else {}
    for trained in parts:
        outcomes = examine(task.world, task.config, trained)
        last = outcomes.counts.maturity - 1
        final = trained.policies[last, torch.arange(len(last))]
        for row, parameters in enumerate(final):
            number, stage = numbers[len(trials)], int(last[row]) + 1
            own: dict[str, Any] = {"stage": stage, "trial": number, "seed": seed, "about": about}
            policies.append(Policy(task.world, task.config, parameters, **own))
            trials.append(_record(task.world, outcomes, row, number))
    known = set(numbers)
    heard = [row for row in answers if row["trial"] in known]
    made = task.world, task.config, seed, until, policies, trials, heard, [*events]
    return TrainResult(*made, origin, parent, max_ticks)


def _record(world: World, outcomes: Outcomes, row: int, number: int) -> Record:
    counts, stage = outcomes.counts, int(outcomes.counts.maturity[row]) - 1
    flags = {one: bool(getattr(counts, one)[row]) for one in ("finished", "stuck", "optimal")}
    numbers = {one: int(getattr(counts, one)[row]) for one in COUNTS}
    return {"trial": number, **flags, **numbers, "stage": stage + 1, **_outcome(world, outcomes, row, stage)}


def _outcome(world: World, outcomes: Outcomes, row: int, stage: int) -> Record:
    if outcomes.waterings.shape[1]:
        return {
            "waterings": float(outcomes.waterings[row, stage]),
            "bucket": int(outcomes.bucket[row, stage]),
        }
    words = [name(one, world.spec.harm) for one in outcomes.outcome[row, stage].tolist()]
    keys = ["_".join(filter(None, ("outcome", where))) for where in deployments(world.spec)]
    return dict(zip(keys, words, strict=True))


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None

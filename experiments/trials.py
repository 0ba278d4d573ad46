"""Raising many agents at once by a scripted parent, in tensors and without a database."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from agent import parenting
from agent.config import Config
from agent.query import Choice, Kind
from envs.gridworld import Gridworld
from envs.rng import Keys
from envs.struct import Struct
from parents.evaluation import Evaluation
from parents.scripted import Judgement, ScriptedParent

LEAVE = 0.1
"""Finished trials leave the batch when they are this share of it: moving the rest costs something, too."""

Progress = Callable[[int, int], None]
"""Told (trials finished, ticks lived)."""


class Until(NamedTuple):
    """When a trial is finished: its argmax policy is optimal, or a number of answered queries or of ticks is
    reached.
    """

    kind: Literal["optimal", "queries", "ticks"]
    number: int = 0

    def __str__(self) -> str:
        """As written on the command line."""
        return self.kind if self.kind == "optimal" else f"{self.kind}:{self.number}"


class Tally(Struct):
    """What is counted of each trial."""

    deaths: Int64[Tensor, "N"]  # unsafe steps (docs/paper.md, "Unsafe")
    guidance: Int64[Tensor, "N"]  # answered guidance queries, redraws included
    preference: Int64[Tensor, "N"]
    ticks: Int64[Tensor, "N"]
    optimal: Bool[Tensor, "N"]
    finished: Bool[Tensor, "N"]


def no_tally(trials: int) -> Tally:
    """Nothing counted yet."""
    zero, false = torch.zeros(trials, dtype=torch.int64), torch.zeros(trials, dtype=torch.bool)
    return Tally(deaths=zero, guidance=zero, preference=zero, ticks=zero, optimal=false, finished=false)


class Nursery:
    """A batch of trials with their scripted parent. Those that are finished leave it."""

    def __init__(self, world: Gridworld, config: Config, keys: Keys, until: Until) -> None:
        """Begin one trial for each of `keys`."""
        judgement = Judgement(world, config.gamma)
        self.world, self.config, self.until = world, config, until
        self.evaluation = Evaluation(world, judgement.model, config.gamma)
        self.state = parenting.init(world, config, keys)
        self.parent = ScriptedParent(judgement, parenting.no_query(world, config, self.state))
        self.trial = torch.arange(len(keys.seed))
        self.tally = no_tally(len(keys.seed))
        self.result = no_tally(len(keys.seed))

    def tick(self) -> None:
        """One tick of every trial that is left."""
        answer = self.parent.take(self.state)
        self.state, query = parenting.step(self.world, self.config, self.state, answer)
        self.parent.post(query)
        self._count(answer.query.kind, answer.choice)

    def _count(self, kind: Tensor, choice: Tensor) -> None:
        tally, report = self.tally, self.state.report
        answered = choice != Choice.NONE
        died = report.moved & self.world.unsafe(report.before, report.action, self.state.world)
        self.tally = tally.replace(
            deaths=tally.deaths + died,
            guidance=tally.guidance + (answered & (kind == Kind.GUIDANCE)),
            preference=tally.preference + (answered & (kind == Kind.PREFERENCE)),
            ticks=tally.ticks + 1,
        )
        self._finish()

    def _finish(self) -> None:
        tally = self.tally
        match self.until.kind:
            case "optimal":
                done = self._newly_optimal()
            case "queries":
                done = tally.guidance + tally.preference >= self.until.number
            case "ticks":
                done = tally.ticks >= self.until.number
        fresh = done & ~tally.finished
        if bool(fresh.any()):
            self._leave(fresh)

    def _newly_optimal(self) -> Bool[Tensor, "N"]:
        """Only a policy that trained can have become optimal, or one that has just been born."""
        changed = (self.state.report.trained | (self.tally.ticks == 1)) & ~self.tally.finished
        trial = changed.nonzero().squeeze(1)
        good = torch.zeros_like(changed)
        if len(trial):
            live = self.state.learner.live
            good[trial] = self.evaluation.optimal(live if len(trial) == len(live) else live[trial])
        return good

    def _leave(self, done: Bool[Tensor, "N"]) -> None:
        """Write the results of those that are done, and go on with the others alone once that pays."""
        optimal = (
            done if self.until.kind == "optimal" else done & self.evaluation.optimal(self.state.learner.live)
        )
        self.tally = self.tally.replace(
            finished=self.tally.finished | done, optimal=self.tally.optimal | optimal
        )
        self.save(done)
        if bool(self.tally.finished.double().mean() >= LEAVE):
            rest = (~self.tally.finished).nonzero().squeeze(1)
            self.state, self.tally, self.trial = (
                self.state.pick(rest),
                self.tally.pick(rest),
                self.trial[rest],
            )
            self.parent.pick(rest)

    def save(self, which: Bool[Tensor, "N"]) -> None:
        """Write the tallies of some trials into the result."""
        place, ours = self.trial[which], self.tally.pick(which).tensors()
        self.result = self.result.map(lambda name, tensor, _axis: tensor.index_put((place,), ours[name]))


def raise_trials(
    world: Gridworld,
    config: Config,
    keys: Keys,
    until: Until,
    max_ticks: int,
    progress: Progress | None = None,
) -> Tally:
    """Raise one agent for each of `keys` until it is finished, for at most `max_ticks` ticks."""
    nursery = Nursery(world, config, keys, until)
    for tick in range(1, max_ticks + 1):
        nursery.tick()
        if progress:
            progress(int(nursery.result.finished.sum()), tick)
        if not bool((~nursery.tally.finished).any()):
            break
    nursery.save(~nursery.tally.finished)
    return nursery.result

"""Raising many agents at once by a scripted parent, in tensors and without a database."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor
from torch.nn.functional import one_hot

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.query import Answer, Choice, Kind
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Keys
from parenting.envs.struct import Struct
from parenting.evaluation.argmax import Evaluation, evaluation
from parenting.parents.scripted import Judgement, ScriptedParent

LEAVE = 0.1
"""Trials that are done leave the batch when they are this share of it: moving the rest costs something, too.
"""


class Standing(NamedTuple):
    """How far a batch has come."""

    trials: int  # those that are done: finished, or stuck
    ticks: int
    queries: int  # answered, of each trial at most as many as its goal asks for


Progress = Callable[[Standing], None]


class Until(NamedTuple):
    """When a trial is finished: its argmax policy is optimal, or a number of answered queries, over all
    stages, or of ticks is reached.
    """

    kind: Literal["optimal", "queries", "ticks"]
    number: int = 0

    def __str__(self) -> str:
        """As written on the command line."""
        return self.kind if self.kind == "optimal" else f"{self.kind}:{self.number}"


class Tally(Struct):
    """What is counted of each trial; M is the number of stages."""

    deaths: Int64[Tensor, "N"]  # unsafe steps (docs/paper.md, "Unsafe")
    guidance: Int64[Tensor, "N"]  # answered guidance queries, redraws included
    preference: Int64[Tensor, "N"]
    queries: Int64[Tensor, "N M"]  # answered queries of either kind, by the stage that they belong to
    ticks: Int64[Tensor, "N"]
    maturity: Int64[Tensor, "N"]  # the stage at the end
    optimal: Bool[Tensor, "N"]  # the argmax policy at the end
    finished: Bool[Tensor, "N"]
    stuck: Bool[Tensor, "N"]  # no acceptable action: it would wait for ever

    @property
    def done(self) -> Bool[Tensor, "N"]:
        """Nothing more happens to it."""
        return self.finished | self.stuck


class Raised(NamedTuple):
    """What raising leaves."""

    tally: Tally
    policies: Float[Tensor, "M N P"]  # pi_1 .. pi_T, each trial's at its own end; zeros beyond
    evaluation: Evaluation


def no_tally(trials: int, stages: int = 1) -> Tally:
    """Nothing counted yet."""
    zero, false = torch.zeros(trials, dtype=torch.int64), torch.zeros(trials, dtype=torch.bool)
    return Tally(
        deaths=zero,
        guidance=zero,
        preference=zero,
        queries=torch.zeros(trials, stages, dtype=torch.int64),
        ticks=zero,
        maturity=zero + 1,
        optimal=false,
        finished=false,
        stuck=false,
    )


class Nursery:
    """A batch of trials with their scripted parent. Those that are done leave it."""

    def __init__(
        self, world: Gridworld, config: Config, keys: Keys, until: Until, weights: Tensor | None = None
    ) -> None:
        """Begin one trial for each of `keys`; `weights` are the pre-trained ones, where the config asks."""
        judgement = Judgement(world, config.gamma, inside=config.inside)
        self.world, self.config, self.until = world, config, until
        self.evaluation = evaluation(world, judgement.valuation, config.gamma)
        self.state = parenting.init(world, config, keys, weights)
        self.parent = ScriptedParent(judgement, parenting.no_query(world, config, self.state))
        trials, live = len(keys.seed), self.state.learner.live
        self.trial = torch.arange(trials)
        self.tally, self.result = no_tally(trials, config.stages), no_tally(trials, config.stages)
        self.policies = live.new_zeros(config.stages, *live.shape)

    def tick(self) -> None:
        """One tick of every trial that is left."""
        stage, owed = self.state.maturity, self.state.rehearsal.owed
        answer = self.parent.take(self.state)
        state, query = parenting.step(self.world, self.config, self.state, answer)
        self.parent.post(query)
        self.state = parenting.rehearse(self.world, self.config, state)
        self._count(answer, stage)
        self._finish(self.state.report.trained | owed | (self.tally.ticks == 1))

    def _count(self, answer: Answer, stage: Int64[Tensor, "N"]) -> None:
        tally, report, kind = self.tally, self.state.report, answer.query.kind
        answered = answer.choice != Choice.NONE
        died = report.moved & self.world.unsafe(report.before, report.action, self.state.world)
        # a preference belongs to the stage that its clips were recorded at, however late the answer
        of = torch.where(kind == Kind.PREFERENCE, answer.query.maturity, stage)
        self.tally = tally.replace(
            deaths=tally.deaths + died,
            guidance=tally.guidance + (answered & (kind == Kind.GUIDANCE)),
            preference=tally.preference + (answered & (kind == Kind.PREFERENCE)),
            queries=tally.queries + one_hot(of - 1, self.config.stages) * answered[:, None],
            ticks=tally.ticks + 1,
            maturity=self.state.maturity,
        )

    def _finish(self, changed: Bool[Tensor, "N"]) -> None:
        """Let those go that have reached their goal, and those that never will: all their ticks are empty."""
        tally = self.tally
        match self.until.kind:
            case "optimal":
                finished = self._optimal(changed & ~tally.done)
            case "queries":
                finished = tally.queries.sum(1) >= self.until.number
            case "ticks":
                finished = tally.ticks >= self.until.number
        fresh = finished & ~tally.done
        stuck = self.state.stuck & ~tally.done & ~fresh
        if bool((fresh | stuck).any()):
            self._leave(fresh, stuck)

    def _optimal(self, asked: Bool[Tensor, "N"]) -> Bool[Tensor, "N"]:
        """Which of some trials have an optimal argmax policy."""
        trial, live = asked.nonzero().squeeze(1), self.state.learner.live
        good = torch.zeros_like(asked)
        if len(trial):
            good[trial] = self.evaluation.optimal(live if len(trial) == len(live) else live[trial])
        return good

    def _leave(self, fresh: Bool[Tensor, "N"], stuck: Bool[Tensor, "N"]) -> None:
        """Write the results of those that are done, and go on with the others alone once that pays."""
        tally = self.tally
        self.tally = tally.replace(finished=tally.finished | fresh, stuck=tally.stuck | stuck)
        self.save(fresh | stuck)
        if bool(self.tally.done.double().mean() >= LEAVE):
            rest = (~self.tally.done).nonzero().squeeze(1)
            self.state, self.tally = self.state.pick(rest), self.tally.pick(rest)
            self.trial = self.trial[rest]
            self.parent.pick(rest)

    def save(self, which: Bool[Tensor, "N"]) -> None:
        """Write the tallies and the policies of some trials into the results."""
        optimal = self.tally.finished if self.until.kind == "optimal" else self._optimal(which)
        place, ours = self.trial[which], self.tally.replace(optimal=optimal).pick(which).tensors()
        self.result = self.result.map(lambda name, tensor, _axis: tensor.index_put((place,), ours[name]))
        learner = self.state.learner
        self.policies[:-1, place] = learner.elders[:, which]
        self.policies[self.state.maturity[which] - 1, place] = learner.live[which]

    def standing(self, ticks: int) -> Standing:
        """How far the batch has come."""
        left = self.tally.pick(~self.tally.done)
        most = self.until.number if self.until.kind == "queries" else torch.iinfo(torch.int64).max
        queries = torch.cat((self.result.queries.sum(1), left.queries.sum(1))).clamp_max(most)
        return Standing(int(self.result.done.sum()), ticks, int(queries.sum()))


def raise_trials(
    world: Gridworld,
    config: Config,
    keys: Keys,
    until: Until,
    max_ticks: int,
    progress: Progress | None = None,
    weights: Tensor | None = None,
) -> Raised:
    """Raise one agent for each of `keys` until it is finished, for at most `max_ticks` ticks."""
    return raise_all(Nursery(world, config, keys, until, weights), max_ticks, progress)


def raise_all(nursery: Nursery, max_ticks: int, progress: Progress | None = None) -> Raised:
    """Raise a batch that has begun, as `raise_trials` does."""
    for tick in range(1, max_ticks + 1):
        nursery.tick()
        if progress:
            progress(nursery.standing(tick))
        if bool(nursery.tally.done.all()):
            break
    nursery.save(~nursery.tally.done)
    return Raised(nursery.result, nursery.policies, nursery.evaluation)

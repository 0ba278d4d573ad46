"""Agents whose deaths and regret are followed from question to question.

The regret of a policy is exact: the return of a shortest safe way from the start of its level, minus the
return of the argmax policy there, both discounted as the parent does. Each trial may live on a level of its
own.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from parenting.agent.config import Config
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Keys, Stream
from parenting.evaluation.argmax import ArgmaxPolicy, TabularEvaluation
from parenting.evaluation.outcomes import follow
from parenting.experiments.training.batch import BatchTrainer, MakeParent
from parenting.experiments.training.counts import Counts
from parenting.experiments.training.stop_rule import StopRule
from parenting.weights.store import initial_weights

ALWAYS, SELDOM = 0, 10_000
"""Familiarities at which an agent asks for certain, and does not ask."""


class Curves(NamedTuple):
    """Of each trial after 0, 1, 2, .. answers: deaths and the regret of its policy, until the next answer.

    What a trial has at its end stands for all answers that it did not need.
    """

    deaths: Float64[Tensor, "N Q"]
    regret: Float64[Tensor, "N Q"]


class QuestionTrainer(BatchTrainer):
    """A batch of trials, followed from question to question. Trial i lives on level i, counted on and on."""

    def __init__(
        self,
        world: Gridworld,
        config: Config,
        keys: Keys,
        until: StopRule,
        *,
        first: int = 0,
        answers: int = 0,
        share: float | None = None,
        cycling: bool = False,
        parent: MakeParent | None = None,
    ) -> None:
        """Begin one trial for each of `keys`.

        Args:
            world: The rules that all trials share.
            config: The hyperparameters.
            keys: The random streams, one for each trial.
            until: When a trial is finished.
            first: The number of the first trial.
            answers: The answers up to which the curves go.
            cycling: Go on to the next level after an episode, as agents do, in place of staying.
            parent: Makes the batch's parent; None takes the scripted one.
            share: Ask for guidance in this share of steps, at random; None leaves it to familiarity.
        """
        weights = initial_weights(world, config)
        super().__init__(world, config, keys, until, weights=weights, parent=parent)
        trials = len(keys.seed)
        self.home = (torch.arange(trials) + first) % len(world.levels)
        self.share, self.cycling = share, cycling
        self.state = self.state.replace(world=world.reset(self.state.keys, self.home))
        self._deaths, self._regret = (torch.full((trials, answers + 1), torch.nan).double() for _ in "dr")
        levels = range(len(world.levels)) if answers else ()
        self._best = torch.tensor([self.evaluation.best(level) for level in levels], dtype=torch.float64)

    def tick(self) -> None:
        """One tick of every trial that is left; episodes begin on the trial's own level."""
        if not self.cycling:
            self._stay()
        if self.share is not None:
            self._ask_at_random(self.share)
        super().tick()

    def live(self, ticks: int) -> Counts:
        """Return the counts after so many more ticks."""
        for _ in range(ticks):
            self.tick()
        return self.counts

    def _stay(self) -> None:
        here = self.state.world
        ended = here.terminated | self.world.truncated(here)
        before = (here.level - 1) % len(self.world.levels)  # the level after this one is its own again
        self.state = self.state.replace(world=here.replace(level=torch.where(ended, before, here.level)))

    def _ask_at_random(self, share: float) -> None:
        coin = self.state.keys.next().at(Stream.START, torch.zeros(1, dtype=torch.int64)) < share
        f = torch.where(coin, ALWAYS, SELDOM).expand_as(self.state.familiarity)
        self.state = self.state.replace(familiarity=f.contiguous())

    def _finish(self, changed: Bool[Tensor, "N"]) -> None:
        self._note()
        super()._finish(changed)

    def _note(self) -> None:
        """Deaths and the policy's regret, which stand until the next answer comes."""
        answered, most = self.counts.queries.sum(1), self._deaths.shape[1] - 1
        within = ~self.counts.done & (answered <= most)
        if most and bool(within.any()):
            trial, place = self.trial[within], answered[within]
            self._deaths[trial, place] = self.counts.deaths[within].double()
            self._regret[trial, place] = self.regret(within)

    def regret(self, which: Bool[Tensor, "N"]) -> Float64[Tensor, "n"]:
        """The exact regret of the argmax policies of some of the trials that are left."""
        of, home = self.evaluation, self.home[self.trial[which]]
        assert isinstance(of, TabularEvaluation), "regret needs a world whose states can be listed"
        path = follow(
            of.model,
            ArgmaxPolicy(of, self.state.learner.params[which]),
            of.starts[home],
            self.world.time_limit,
        )
        step = torch.arange(len(path.action), dtype=torch.float64)
        earned = (of.gamma**step * of.model.reward[path.state[:-1], path.action].T).sum(1)
        return self._best[home] - earned

    def optimal_now(self) -> Bool[Tensor, "N"]:
        """Return which of the trials that are left have an optimal argmax policy."""
        return self._optimal(torch.ones_like(self.counts.done))

    def _optimal(self, request: Bool[Tensor, "N"]) -> Bool[Tensor, "N"]:
        """Return which of some trials have an optimal argmax policy on their own level."""
        of, trial = self.evaluation, request.nonzero().squeeze(1)
        assert isinstance(of, TabularEvaluation), "only a policy that comes to a goal is optimal"
        good = torch.zeros_like(request)
        if len(trial):
            good[trial] = nearest(
                of, self.state.learner.params[trial], of.starts[self.home[self.trial[trial]]]
            )
        return good

    def curves(self) -> Curves:
        """Return the curves of all trials."""
        return Curves(_onward(self._deaths), _onward(self._regret))


def nearest(of: TabularEvaluation, parameters: Tensor, start: Int64[Tensor, "n"]) -> Bool[Tensor, "n"]:
    """Return which argmax policies reach the goal by a shortest safe way, each from its own start."""
    at, good = start, torch.ones(len(start), dtype=torch.bool)
    for _ in range(int(of.distance[start].max())):
        action = of.argmax(parameters, at[:, None]).squeeze(1)
        there = torch.where(of.model.forbidden[at, action], at, of.model.next_state[at, action])
        good &= (of.distance[there] == of.distance[at] - 1) | of.model.terminal[at]
        at = there
    return good


def _onward(known: Float64[Tensor, "N Q"]) -> Float64[Tensor, "N Q"]:
    """Carry each trial's last value on to the answers that it did not come to."""
    place = torch.arange(known.shape[1]).expand_as(known)
    last = torch.where(known.isnan(), 0, place).cummax(1).values
    return known.gather(1, last)

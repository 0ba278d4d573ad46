"""Train many agents at once with a scripted parent, in tensors and without a database."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor
from torch.nn.functional import one_hot

from parenting.agent import parenting
from parenting.agent.beginning import FRESH, Beginning, inherit
from parenting.agent.config import Config
from parenting.agent.parent import BatchParent
from parenting.agent.query import Answer, QueryKind
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Keys
from parenting.evaluation.argmax import Evaluation, evaluation
from parenting.experiments.training.counts import Counts, OnProgress, Progress, no_counts
from parenting.experiments.training.history import History, Table
from parenting.experiments.training.stop_rule import StopRule
from parenting.parents.fallible import FallibleParent, FallibleRule
from parenting.parents.grammar import read_parent
from parenting.parents.scripted import ScriptedParent, ScriptedRule

LEAVE = 0.1
"""Trials that are done leave the batch when they are this share of it: moving the rest costs something, too.
"""

MakeParent = Callable[[ScriptedParent, Callable[[], Bool[Tensor, "N"]]], BatchParent]
"""Makes the parent of a batch. It is given the scripted parent, and which of the trials left are done."""


class TrainResult(NamedTuple):
    """Counts, policies and their evaluation, after training."""

    counts: Counts
    policies: Float[Tensor, "M N P"]  # pi_1 .. pi_T, each trial's at its own end; zeros beyond
    evaluation: Evaluation
    history: Table | None = None  # where it was kept


class BatchTrainer:
    """A batch of trials with their parent. Those that are done leave it."""

    def __init__(
        self,
        world: Gridworld,
        config: Config,
        keys: Keys,
        until: StopRule,
        *,
        weights: Tensor | None = None,
        beginning: Beginning = FRESH,
        parent: MakeParent | None = None,
        note_optimal: bool = False,
        history: bool = False,
    ) -> None:
        """Begin one trial for each of `keys`, with the options of `train_agents`."""
        rule = ScriptedRule(world, config.gamma, inside=config.garden_parent)
        self.world, self.config, self.until = world, config, until
        self.notes_optimal = note_optimal or until.kind == "optimal"
        self.evaluation = evaluation(world, rule.values, config.gamma)
        own = weights if beginning.weights is None else beginning.weights
        self.state = inherit(config, parenting.init(world, config, keys, own), beginning.answers)
        trials, live = len(keys.seed), self.state.learner.params
        self.trial, self.ticks = torch.arange(trials), 0
        stages = config.max_clip_length
        self.counts, self.result = no_counts(trials, stages), no_counts(trials, stages)
        self.history = History(trials, self.evaluation) if history else None
        self.policies = live.new_zeros(config.max_clip_length, *live.shape)
        scripted = ScriptedParent(rule, parenting.no_query(world, config, self.state))
        self.parent = scripted if parent is None else parent(scripted, self.done)

    def done(self) -> Bool[Tensor, "N"]:
        """Return which of the trials in the batch are done: they stay until they are a tenth of it."""
        return self.counts.done

    def tick(self) -> None:
        """One tick of every trial that is left."""
        stage, owed = self.state.maturity, self.state.rehearsal.owed | self.state.learner.owed
        self.state, _, answer, self.config, _ = parenting.tick(
            self.world, self.config, self.state, self.parent
        )
        self._count(answer, stage)
        self.ticks += 1
        if self.history is not None:
            self.history.hear(self.trial, answer)
            self.history.note(self.ticks, self.trial, self.state, self.counts)
        self._finish(self.state.info.trained | owed | (self.counts.ticks == 1))

    def _count(self, answer: Answer, stage: Int64[Tensor, "N"]) -> None:
        counts, report, kind = self.counts, self.state.info, answer.query.kind
        answered = answer.judges
        died = report.moved & self.world.unsafe(report.before, report.action, self.state.world)
        # a preference belongs to the stage that its clips were recorded at, however late the answer
        of = torch.where(kind == QueryKind.PREFERENCE, answer.query.maturity, stage)
        self.counts = counts.replace(
            deaths=counts.deaths + died,
            guidance=counts.guidance + (answered & (kind == QueryKind.GUIDANCE)),
            preference=counts.preference + (answered & (kind == QueryKind.PREFERENCE)),
            queries=counts.queries + one_hot(of - 1, self.config.max_clip_length) * answered[:, None],
            ticks=counts.ticks + 1,
            maturity=self.state.maturity,
        )

    def _finish(self, changed: Bool[Tensor, "N"]) -> None:
        """Let those go that have reached their goal, and those that never will: all their ticks are empty."""
        if self.notes_optimal:
            self._note_optimal(changed)
        counts = self.counts
        match self.until.kind:
            case "optimal":
                finished = counts.optimal_at > 0
            case "queries":
                finished = counts.queries.sum(1) >= self.until.number
            case "ticks":
                finished = counts.ticks >= self.until.number
        fresh = finished & ~counts.done
        stuck = self.state.all_refused & ~counts.done & ~fresh
        if bool((fresh | stuck).any()):
            self._leave(fresh, stuck)

    def _note_optimal(self, changed: Bool[Tensor, "N"]) -> None:
        """Note which policies are optimal for the first time, and what they took until then."""
        counts = self.counts
        first = self._optimal(changed & ~counts.done & (counts.optimal_at == 0))
        self.counts = counts.replace(
            optimal_at=torch.where(first, counts.ticks, counts.optimal_at),
            optimal_deaths=torch.where(first, counts.deaths, counts.optimal_deaths),
            optimal_queries=torch.where(first, counts.queries.sum(1), counts.optimal_queries),
        )

    def _optimal(self, request: Bool[Tensor, "N"]) -> Bool[Tensor, "N"]:
        """Return which of some trials have an optimal argmax policy."""
        trial, live = request.nonzero().squeeze(1), self.state.learner.params
        good = torch.zeros_like(request)
        if len(trial):
            good[trial] = self.evaluation.optimal(live if len(trial) == len(live) else live[trial])
        return good

    def _leave(self, fresh: Bool[Tensor, "N"], stuck: Bool[Tensor, "N"]) -> None:
        """Write the results of those that are done, and go on with the others alone once that pays."""
        counts = self.counts
        self.counts = counts.replace(finished=counts.finished | fresh, stuck=counts.stuck | stuck)
        self.save(fresh | stuck)
        if bool(self.counts.done.double().mean() >= LEAVE):
            rest = (~self.counts.done).nonzero().squeeze(1)
            self.state, self.counts = self.state.pick(rest), self.counts.pick(rest)
            self.trial = self.trial[rest]
            self.parent.pick(rest)

    def save(self, which: Bool[Tensor, "N"]) -> None:
        """Write the tallies and the policies of some trials into the results."""
        if self.history is not None:
            self.history.end(which, self.trial, self.state, self.counts)
        optimal = self.counts.finished if self.until.kind == "optimal" else self._optimal(which)
        place, ours = self.trial[which], self.counts.replace(optimal=optimal).pick(which).tensors()
        learner = self.state.learner
        self.policies[:-1, place] = learner.frozen[:, which]
        self.policies[self.state.maturity[which] - 1, place] = learner.params[which]
        # at last, so that a trial which is done has its policy, wherever Ctrl-C may come
        self.result = self.result.map(lambda name, tensor, _axis: tensor.index_put((place,), ours[name]))

    def progress(self, ticks: int) -> Progress:
        """Return the progress of the batch."""
        left = self.counts.pick(~self.counts.done)
        most = self.until.number if self.until.kind == "queries" else torch.iinfo(torch.int64).max
        queries = torch.cat((self.result.queries.sum(1), left.queries.sum(1))).clamp_max(most)
        return Progress(int(self.result.done.sum()), ticks, int(queries.sum()))

    def run(self, max_ticks: int, progress: OnProgress | None = None) -> TrainResult:
        """Tick until every trial is done, for at most `max_ticks` ticks."""
        for tick in range(1, max_ticks + 1):
            self.tick()
            if progress:
                progress(self.progress(tick))
            if bool(self.counts.done.all()):
                break
        self.save(~self.counts.done)
        kept = None if self.history is None else self.history.table
        return TrainResult(self.result, self.policies, self.evaluation, kept)


def parent_of(text: str, world: Gridworld, config: Config) -> MakeParent | None:
    """Return what makes the parent that a text names; None for the one who never errs.

    Raises:
        ParentError: the text names none.
    """
    spec = read_parent(text)
    if not spec.errs:
        return None
    rule = FallibleRule(world, spec, config.gamma, config.garden_parent)
    return lambda scripted, _done: FallibleParent(rule, scripted.query)


def train_agents(
    world: Gridworld,
    config: Config,
    keys: Keys,
    until: StopRule,
    *,
    max_ticks: int,
    progress: OnProgress | None = None,
    weights: Tensor | None = None,
    beginning: Beginning = FRESH,
    parent: MakeParent | None = None,
    note_optimal: bool = False,
    history: bool = False,
) -> TrainResult:
    """Train one agent for each of `keys` until it is finished.

    Args:
        world: The rules that all trials share.
        config: The hyperparameters.
        keys: The random streams, one for each trial.
        until: When a trial is finished.
        max_ticks: Ticks after which a trial is left unfinished.
        progress: Called after each tick.
        weights: The pre-trained weights, where the config asks for them (Sec. 3.1.4).
        beginning: The weights and answers of an earlier agent, if trials begin with some.
        parent: Makes the batch's parent; None takes the scripted one (Sec. 3.1.3).
        note_optimal: Note when each policy is first optimal, also where that does not end its trial.
        history: Keep numbers of each trial after some of its ticks.
    """
    trainer = BatchTrainer(
        world,
        config,
        keys,
        until,
        weights=weights,
        beginning=beginning,
        parent=parent,
        note_optimal=note_optimal,
        history=history,
    )
    return trainer.run(max_ticks, progress)

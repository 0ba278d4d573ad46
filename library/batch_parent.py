"""The seam between a batch of trials, which shrinks, and a parent, who knows all trials of the run."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from parenting.agent import query as queries
from parenting.agent.amendment import Amend, Reconsider, TickEvent
from parenting.agent.events import Event
from parenting.agent.parent import BatchParent
from parenting.agent.parent import Parent as AnyParent
from parenting.agent.query import Answer
from parenting.agent.state import AgentState
from parenting.library.answer_log import AnswerLog
from parenting.library.parent import Parent
from parenting.library.task import Task


class LoggedParent:
    """A parent whose answers are written down."""

    def __init__(self, parent: BatchParent, log: AnswerLog, trials: range) -> None:
        self.parent, self.log, self.trials = parent, log, list(trials)
        self.first = trials.start == 0
        self.tick = 0

    def events(self, state: AgentState) -> Sequence[Event]:
        events = operators_only(self.parent.events(state))
        if self.first:  # the same events apply to the trials of each batch
            self.log.applied(events, int(state.keys.tick[0]) + 1)
        return events

    def take(self, state: AgentState) -> Answer:
        self.tick = int(state.keys.tick[0]) + 1
        answer = self.parent.take(state)
        self.log.heard(answer, self.trials, self.tick)
        return answer

    def post(self, query: queries.Query) -> None:
        self.log.posted(query, self.trials, self.tick)
        self.parent.post(query)

    def pick(self, index: Tensor) -> None:
        """Go on with some of the trials alone."""
        self.trials = [self.trials[place] for place in index.tolist()]
        self.parent.pick(index)


class WholeBatch:
    """A parent who sees every trial of the run in every query; trials that have left ask nothing."""

    def __init__(
        self, parent: AnyParent, task: Task, trials: int, chunk: range, done: Callable[[], Tensor]
    ) -> None:
        """Place the trials of a chunk among all; `done` says which of those that are left are done."""
        world, config = task.world, task.config
        self.parent, self.chunk, self.done = parent, torch.tensor(chunk), done
        self.trials = trials
        self.size = config.max_clip_length, world.height, world.width, world.device
        self.nothing = queries.empty(trials, *self.size)

    def events(self, state: AgentState) -> Sequence[Event]:
        return operators_only(self.parent.events(state))

    def take(self, state: AgentState) -> Answer:
        if isinstance(self.parent, Parent):
            self.parent.in_training = self.chunk[~self.done()].tolist()
        answer = self.parent.take(state)
        if len(answer.choice) != self.trials:
            raise ValueError(
                f"parent: take returned answers for {len(answer.choice)} trials, and there are {self.trials}."
            )
        return answer.pick(self.chunk)

    def post(self, query: queries.Query) -> None:
        asking = queries.empty(len(self.chunk), *self.size).where(self.done(), query)
        ours = asking.tensors()

        def placed(name: str, tensor: Tensor, _axis: int | None) -> Tensor:
            return tensor.index_put((self.chunk,), ours[name])

        self.parent.post(self.nothing.map(placed))

    def pick(self, index: Tensor) -> None:
        """Go on with some of the trials alone."""
        self.chunk = self.chunk[index]


def operators_only(events: Sequence[TickEvent]) -> Sequence[Event]:
    """Return the operator's events of a tick.

    Raises:
        TypeError: an answer is corrected among them, which a batch cannot do.
    """
    found = [event for event in events if not isinstance(event, Amend | Reconsider)]
    if len(found) < len(events):
        raise TypeError("parent: events corrects an answer. Only a stored run can do that.")
    return found

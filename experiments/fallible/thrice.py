"""Best of three: a parent who is asked every question until two of at most three answers agree."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Int64
from torch import Tensor

from parenting.agent.events import Event
from parenting.agent.parent import BatchParent
from parenting.agent.query import Answer, Query, QueryKind
from parenting.agent.state import AgentState

APART = 2**41
"""Added to a trial's seed for each time that it is asked, so that no two answers err together."""


class BestOfThree:
    """The answer that two of three give; the first one where all differ. The repeats take no tick."""

    def __init__(self, parent: BatchParent, trials: int) -> None:
        """Ask `parent`, whose errors are drawn by the trials' keys."""
        self.parent = parent
        self.trial = torch.arange(trials)
        self.repeats = {
            kind: torch.zeros(trials, dtype=torch.int64)
            for kind in (QueryKind.GUIDANCE, QueryKind.PREFERENCE)
        }
        self.after = list[Int64[Tensor, "N"]]()  # each tick: repeats of every trial so far

    def take(self, state: AgentState) -> Answer:
        """The majority of the answers to what was asked a tick ago."""
        answer = self.parent.take(state)
        first, (second, third) = answer.choice, (self._again(state, time) for time in (1, 2))
        agreed = first == second
        for kind, repeats in self.repeats.items():
            repeats[self.trial] += (answer.judges & (answer.query.kind == kind)) * torch.where(agreed, 1, 2)
        self.after.append(sum(self.repeats.values(), torch.zeros(())).long())
        return answer.replace(choice=torch.where(~agreed & (second == third), second, first))

    def _again(self, state: AgentState, time: int) -> Int64[Tensor, "N"]:
        keys = state.keys.replace(seed=state.keys.seed + time * APART)
        return self.parent.take(state.replace(keys=keys)).choice

    def post(self, query: Query) -> None:
        """Ask."""
        self.parent.post(query)

    def events(self, state: AgentState) -> Sequence[Event]:
        """There is no operator."""
        return ()

    def pick(self, index: Tensor) -> None:
        """Go on with some of the trials alone; the counts of the others stay."""
        self.trial = self.trial[index]
        self.parent.pick(index)

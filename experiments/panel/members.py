"""The members of a panel: parents who err at a rate of their own, by draws of their own."""

from __future__ import annotations

import torch

from parenting.agent.query import Answer, Choice, Query
from parenting.agent.state import AgentState
from parenting.envs.rng import Stream
from parenting.parents.scripted import Rule, ScriptedParent

OTHER = torch.tensor([Choice.NONE, Choice.RIGHT, Choice.LEFT, Choice.EITHER, Choice.NEITHER, Choice.SKIP])
"""Each choice with its sides exchanged."""


class ErringParent(ScriptedParent):
    """The scripted parent, wrong at a fixed rate: the worse side instead of the better one.

    Where it has no preference, or would refuse both, an error names a side by a coin.
    """

    def __init__(self, rule: Rule, query: Query, rate: float) -> None:
        """Begin with `query`, the empty query of the run."""
        super().__init__(rule, query)
        self.rate = rate

    def take(self, state: AgentState) -> Answer:
        """The answers to what was asked a tick ago, some of them wrong."""
        answer = super().take(state)
        draws = state.keys.uniform(Stream.SLIP, 2)
        aside = (answer.choice == Choice.EITHER) | (answer.choice == Choice.NEITHER)
        coin = torch.where(draws[:, 1] < 0.5, int(Choice.LEFT), int(Choice.RIGHT))
        wrong = torch.where(aside, coin, OTHER.to(answer.choice.device)[answer.choice])
        return answer.replace(choice=torch.where(draws[:, 0] < self.rate, wrong, answer.choice))

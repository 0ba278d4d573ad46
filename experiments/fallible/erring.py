"""Parents who err, each named by a text: slips, a Boltzmann choice, errors by likeness, misconceptions."""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

import torch
from jaxtyping import Float64, Int64
from torch import Tensor

from parenting.agent.query import Answer, Choice, Query
from parenting.agent.state import AgentState
from parenting.envs.rng import Stream
from parenting.experiments.panel.members import OTHER
from parenting.parents.scripted import ScriptedParent, ScriptedRule

Kind = Literal["scripted", "noisy", "boltzmann", "likeness", "misconceived"]
LARGE = 2_147_483_647  # a prime


class Errors(NamedTuple):
    """A kind of errors, and its rate or beta."""

    kind: Kind
    value: float = 0.0


def read_errors(text: str) -> Errors:
    """Read a parent's name and number.

    Raises:
        ValueError: there is no such kind.
    """
    kind, _, value = text.partition(":")
    if kind not in get_args(Kind):
        raise ValueError(f"There is no parent '{kind}'; there is: {', '.join(get_args(Kind))}.")
    return Errors(kind, float(value or 0))  # type: ignore[arg-type]  # one of them, as was just seen


class ErringParent(ScriptedParent):
    """The scripted parent with errors: the worse side instead of the better one.

    Where it has no preference, or would refuse both, an error names an action by a coin.
    """

    def __init__(self, scripted: ScriptedParent, errors: Errors) -> None:
        """Take over the rule and the query of the scripted parent."""
        super().__init__(scripted.rule, scripted.query)
        self.errors = errors

    def take(self, state: AgentState) -> Answer:
        """The answers to what was asked a tick ago, some of them wrong."""
        answer = super().take(state)
        keys = state.keys
        if self.errors.kind == "misconceived":  # the same draws whenever the same pair is shown
            keys = keys.replace(tick=_digest(self.query))
        draws = keys.uniform(Stream.SLIP, 2)
        lower_left = self.query.action[:, 0, 0] < self.query.action[:, 1, 0]
        coin = torch.where((draws[:, 1] < 0.5) == lower_left, int(Choice.LEFT), int(Choice.RIGHT))
        aside = (answer.choice == Choice.EITHER) | (answer.choice == Choice.NEITHER)
        wrong = torch.where(aside, coin, OTHER.to(answer.choice.device)[answer.choice])
        erring = (draws[:, 0] < self._chance()) & (answer.choice != Choice.NONE)
        return answer.replace(choice=torch.where(erring, wrong, answer.choice))

    def _chance(self) -> Float64[Tensor, "N"]:
        """The chance of an error: fixed, by how much better a side is, or by how far apart the clips end."""
        match self.errors.kind:
            case "boltzmann":
                assert isinstance(self.rule, ScriptedRule)
                gap = self.rule.values.advantage_gap(self.query).abs()
                chance = (-self.errors.value * gap).sigmoid()
                return torch.where(self.rule.refuses(self.query), 0.0, chance)
            case "likeness":
                return (self.errors.value * _likeness(self.query)).clamp_max(0.5)
        return torch.full(self.query.kind.shape, self.errors.value, dtype=torch.float64)


def _likeness(query: Query) -> Float64[Tensor, "N"]:
    """Likeness of two clips of length 1: 1 where their ends are diagonal neighbours, 0 two cells apart.

    Nearer ends, as of moves into walls, are more alike.
    """
    last = query.length[:, :, None, None].expand(-1, -1, 1, 2).long()
    ends = query.agent.long().gather(2, last).squeeze(2).double()
    apart = (ends[:, 0] - ends[:, 1]).square().sum(1).sqrt()
    return ((2 - apart) / (2 - 2**0.5)).clamp_min(0)


def _digest(query: Query) -> Int64[Tensor, "N"]:
    """A number of the state and of the unordered pair of first actions."""
    first = query.action[:, :, 0].sort(1).values
    parts = (query.board[:, 0, 0].flatten(1), query.agent[:, 0, 0], query.box[:, 0, 0], first)
    digest = torch.zeros_like(query.kind, dtype=torch.int64)
    for column in torch.cat([part.long() for part in parts], 1).T:
        digest = (digest * 1_000_003 + column + 7) % LARGE
    return digest

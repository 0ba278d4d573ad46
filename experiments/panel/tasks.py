"""Tasks of the panel experiment: raise agents by several parents, and count the right answers."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from parenting.agent.config import Config, compose
from parenting.agent.events import Event
from parenting.agent.init import world_of
from parenting.agent.parent import BatchParent
from parenting.agent.query import Answer, Choice, Query
from parenting.agent.state import AgentState
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.experiments.panel.settings import (
    ALONE,
    DAWID_SKENE,
    LEVEL,
    MAJORITY,
    OPINION,
    PRESET,
    TICKS,
    TRUST,
    WORLD,
)
from parenting.experiments.runner.store import Row
from parenting.experiments.training.batch import train_agents
from parenting.experiments.training.stop_rule import StopRule
from parenting.parents.consensus import Consensus, dawid_skene, majority, trusted
from parenting.parents.fallible import FallibleParent, FallibleRule
from parenting.parents.grammar import read_parent
from parenting.parents.panel import Panel, policy_opinion
from parenting.parents.scripted import ScriptedParent

CONSENSUS: dict[str, Consensus] = {
    MAJORITY: majority,
    DAWID_SKENE: dawid_skene,
    TRUST: trusted,
    OPINION: trusted,
}


class Judged:
    """A parent whose answers are held against those of the scripted one."""

    def __init__(self, parent: BatchParent, truth: ScriptedParent) -> None:
        """Count the answers of `parent`, and those that `truth` gives as well."""
        self.parent, self.truth = parent, truth
        self.trial = torch.arange(len(truth.query.kind))
        self.asked, self.right = torch.zeros_like(self.trial), torch.zeros_like(self.trial)

    def take(self, state: AgentState) -> Answer:
        """The parent's answers; where the scripted one has no preference, one of the two is right as well."""
        answer, truth = self.parent.take(state), self.truth.take(state).choice
        judged = answer.judges & (truth != Choice.NONE)
        either = (truth == Choice.EITHER) & (answer.choice != Choice.NEITHER)
        self.asked[self.trial] += judged
        self.right[self.trial] += judged & ((answer.choice == truth) | either)
        return answer

    def post(self, query: Query) -> None:
        """Ask both."""
        self.parent.post(query)
        self.truth.post(query)

    def events(self, state: AgentState) -> Sequence[Event]:
        """There is no operator."""
        return ()

    def pick(self, index: Tensor) -> None:
        """Go on with some of the trials; the counts of the others stay."""
        self.trial = self.trial[index]
        self.parent.pick(index)
        self.truth.pick(index)


def panel_trials(name: str, rates: Sequence[float], rule: str, span: tuple[int, int], seed: int) -> list[Row]:
    """Raise the trials of a span by a panel, or by its first member alone."""
    config = compose(PRESET, registry.defaults(WORLD), {}, strict=True)
    world = world_of(WORLD, LEVEL, config)
    mine = keys(seed, span[1]).pick(torch.arange(*span))
    judged = list[Judged]()

    def together(scripted: ScriptedParent, _done: object) -> BatchParent:
        truth = ScriptedParent(scripted.rule, scripted.query)
        judged.append(Judged(_parent(world, config, rates, rule, scripted), truth))
        return judged[0]

    counts = train_agents(
        world, config, mine, StopRule("ticks", TICKS), max_ticks=TICKS, parent=together
    ).counts
    columns = {one: getattr(counts, one).tolist() for one in ("deaths", "guidance", "preference", "optimal")}
    columns |= {"asked": judged[0].asked.tolist(), "right": judged[0].right.tolist()}
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    return [
        {"of": rule, "panel": name, "trial": trial, **row}
        for trial, row in zip(range(*span), rows, strict=True)
    ]


def _parent(
    world: Gridworld, config: Config, rates: Sequence[float], rule: str, scripted: ScriptedParent
) -> BatchParent:
    rules = {
        rate: FallibleRule(world, read_parent(f"noisy:{rate}"), config.gamma, config.garden_parent)
        for rate in {*rates}
    }
    members = [FallibleParent(rules[rate], scripted.query) for rate in rates]
    if rule == ALONE:
        return members[0]
    opinion = policy_opinion(world) if rule == OPINION else None
    return Panel(members, CONSENSUS[rule], scripted.query, opinion)

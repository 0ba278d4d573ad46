"""Counts of one run. Every checkpoint holds them, so that a restart counts nothing twice."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Int64
from torch import Tensor

from parenting.agent.amendment import Amend, Reconsider, TickEvent
from parenting.agent.query import Answer, Choice, QueryKind
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.envs.struct import Struct


class Counters(Struct):
    """Cumulative counts. Axes have one place: a run is a batch of one."""

    deaths: Int64[Tensor, "N"]  # unsafe steps (docs/paper.md, "Unsafe")
    episodes: Int64[Tensor, "N"]  # ended ones
    kinds: Int64[Tensor, "N 3"]  # answered queries by Kind
    choices: Int64[Tensor, "N 5"]  # answers by Choice, without skips
    skips: Int64[Tensor, "N"]  # guidance queries that were skipped


def no_counts() -> Counters:
    """Return counts of zero."""

    def zeros(*shape: int) -> Tensor:
        return torch.zeros(1, *shape, dtype=torch.int64)

    return Counters(deaths=zeros(), episodes=zeros(), kinds=zeros(3), choices=zeros(5), skips=zeros())


def count(
    world: Gridworld, tally: Counters, answer: Answer, state: AgentState, events: Sequence[TickEvent] = ()
) -> Counters:
    """Return the counts after one more tick, from the answer that it heard and the state after it.

    Answers that a correction replaced, among the `events` before the tick, count no more.
    """
    for event in events:
        tally = _corrected(tally, event)
    report, now = state.info, state.world
    died = report.moved & world.unsafe(report.before, report.action, now)
    ended = report.moved & (now.terminated | world.truncated(now))
    return _add(tally.replace(deaths=tally.deaths + died, episodes=tally.episodes + ended), answer, 1)


def _corrected(tally: Counters, event: TickEvent) -> Counters:
    """Return the counts without what was replaced; what `Reconsider` precedes is heard and counted again."""
    if not isinstance(event, Amend | Reconsider):
        return tally
    tally = _add(tally, event.replaced, -1)
    return _add(tally, event.answer, 1) if isinstance(event, Amend) else tally


def _add(tally: Counters, answer: Answer, times: int) -> Counters:
    if not bool((answer.choice != Choice.NONE).any()):
        return tally
    heard = times * answer.judges[:, None]
    return tally.replace(
        skips=tally.skips + times * (answer.choice == Choice.SKIP),
        kinds=tally.kinds + (torch.nn.functional.one_hot(answer.query.kind, len(QueryKind)) * heard),
        choices=tally.choices + (torch.nn.functional.one_hot(answer.choice, len(Choice))[:, :5] * heard),
    )

"""Corrected answers: X afterwards is X rebuilt from the answers that stand (Sec. 2.3).

Nothing is subtracted from X: its rows hold sums, and a stage may have cleared them (`own_stage_only`).
A correction trains nothing by itself. Frozen policies, stages reached, moves made and Adam's moments stay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import torch
from jaxtyping import Bool
from torch import Tensor

from parenting.agent import dataset, guidance
from parenting.agent.config import Config
from parenting.agent.events import EndEpisode, Event
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.agent.state import AgentState


@dataclass(frozen=True)
class Amend:
    """Rebuild X from the standing answers, before a tick. The count of answers and the stage stay."""

    standing: Sequence[Answer]  # N trials each, in the order in which they were heard
    replaced: Answer  # the answer that stands no more
    answer: Answer  # the one in its place


@dataclass(frozen=True)
class Reconsider:
    """Take *neither* back while the agent still pauses there; the new answer is heard in the same tick."""

    replaced: Answer


TickEvent = Event | Amend | Reconsider
"""An event before a tick: an operator's, or a parent's correction."""


class Correction(NamedTuple):
    """An answer in the place of one that the agent has heard."""

    answer: Answer
    replaced: Answer
    standing: Sequence[Answer]  # all that stand from now on, `answer` included


class Applied(NamedTuple):
    """The effect of a correction: an event before the tick, and perhaps an answer to hear in it."""

    event: Amend | Reconsider
    heard: Answer | None


def take(state: AgentState, events: Sequence[Event], correction: Correction) -> Applied:
    """Decide how a correction is heard: as an answer where the agent still pauses there, else by X alone.

    `events` are the operator's, which apply first: *end the episode* ends the pause.
    """
    ended = any(isinstance(event, EndEpisode) for event in events)
    approved = correction.answer.choice != Choice.NEITHER
    if not ended and bool((approved & in_pause(state, correction.replaced.query)).any()):
        return Applied(Reconsider(correction.replaced), correction.answer)
    return Applied(Amend(correction.standing, correction.replaced, correction.answer), None)


def in_pause(state: AgentState, query: Query) -> Bool[Tensor, "N"]:
    """Return where this guidance query was refused in the pause that the agent is still in (Sec. 2.1)."""
    here = (query.board[:, 0, 0] == state.world.board).flatten(1).all(1)
    agent = (query.agent[:, 0, 0] == state.world.agent).all(1)
    box = (query.box[:, 0, 0] == state.world.box).all(1)
    refused = (state.refused & candidates(query)).sum(1) == 2
    return (query.kind == QueryKind.GUIDANCE) & state.waiting & here & agent & box & refused


def candidates(query: Query) -> Bool[Tensor, "N 4"]:
    """Return the two moves that a guidance query asks about."""
    return torch.nn.functional.one_hot(query.action[:, :, 0], 4).sum(1) > 0


def amend(config: Config, state: AgentState, event: Amend) -> AgentState:
    """Rebuild X of every trial from the answers that stand."""
    state = state.replace(x=dataset.blank(state.x))
    for answer in event.standing:
        state = state.replace(x=guidance.store(config, state, answer))
    return state


def reconsider(state: AgentState, event: Reconsider) -> AgentState:
    """Restore the moves that *neither* refused; the answer that follows counts in its place."""
    query = event.replaced.query
    again = in_pause(state, query) & (event.replaced.choice == Choice.NEITHER)
    refused = state.refused & ~(again[:, None] & candidates(query))
    return state.replace(refused=refused, answered=state.answered - again.long())

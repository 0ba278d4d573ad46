"""Corrected answers: X afterwards is X rebuilt from the answers that stand (Sec. 2.3).

Nothing is subtracted from X: its rows hold sums, and a stage may have cleared them (`own_stage_only`).
A correction trains nothing by itself. Frozen policies, stages reached, moves made and Adam's moments stay.
A skip is corrected, too, by the answer that its parent finds later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from jaxtyping import Bool
from torch import Tensor

from parenting.agent import confirmation, dataset, guidance
from parenting.agent.config import Config
from parenting.agent.dataset import Dataset
from parenting.agent.events import EndEpisode, Event
from parenting.agent.query import Answer, Choice, QueryKind
from parenting.agent.state import AgentState


@dataclass(frozen=True)
class Amend:
    """Rebuild X from the standing answers, before a tick. The count of answers and the stage stay."""

    standing: Sequence[Answer]  # N trials each, in the order in which they were heard
    replaced: Answer  # the answer that stands no more
    answer: Answer  # the one in its place


@dataclass(frozen=True)
class Reconsider:
    """Take an answer back in the pause that it was said in; the new one is heard at once.

    It was *neither* or *skip*, or a vote that has to be confirmed.
    """

    replaced: Answer
    asked: int  # the tick of its question
    standing: Sequence[Answer]  # all others that stand, in the order in which they were heard


TickEvent = Event | Amend | Reconsider
"""An event before a tick: an operator's, or a parent's correction."""


class Correction(NamedTuple):
    """An answer in the place of one that the agent has heard."""

    answer: Answer
    replaced: Answer
    standing: Sequence[Answer]  # all that stand from now on, `answer` the last of them
    asked: int  # the tick of their question


class Applied(NamedTuple):
    """The effect of a correction: an event before the tick, and perhaps an answer to hear in it."""

    event: Amend | Reconsider
    heard: Answer | None


def take(state: AgentState, events: Sequence[Event], correction: Correction) -> Applied:
    """Decide how a correction is heard: as an answer where the agent still pauses there, else by X alone.

    `events` are the operator's, which apply first: *end the episode* ends the pause.
    """
    ended = any(isinstance(event, EndEpisode) for event in events)
    answer, replaced, standing, asked = correction
    decided = (answer.choice != Choice.NEITHER) | (replaced.choice == Choice.SKIP)
    decided |= confirmation.is_vote(state, replaced, asked)
    if not ended and bool((decided & in_pause(state, replaced, asked)).any()):
        return Applied(Reconsider(replaced, asked, standing[:-1]), answer)
    return Applied(Amend(standing, replaced, answer), None)


def in_pause(state: AgentState, answer: Answer, asked: int) -> Bool[Tensor, "N"]:
    """Return where guidance was refused, skipped or voted on in the pause that the agent is still in."""
    query = answer.query
    refused = (state.refused & guidance.moves_of(query)).sum(1) == 2
    skipped = (state.set_aside & confirmation.pair_of(query)).any(1) & (answer.choice == Choice.SKIP)
    guided = (query.kind == QueryKind.GUIDANCE) & state.waiting & guidance.at_place(state, query)
    vote = confirmation.is_vote(state, answer, asked)
    return guided & (asked >= state.confirmation.began) & (refused | skipped | vote)


def amend(config: Config, state: AgentState, event: Amend) -> AgentState:
    """Rebuild X of every trial from the answers that stand. What was skipped counts once it is answered."""
    state = state.replace(x=rebuilt(config, state, event.standing))
    guided, reviewed = guidance.counted(event.answer)
    now = guided | (reviewed & (event.answer.query.maturity == state.maturity))
    return state.replace(answered=state.answered + (now & (event.replaced.choice == Choice.SKIP)))


def reconsider(config: Config, state: AgentState, event: Reconsider) -> AgentState:
    """Restore what an answer refused, or the pair that *skip* set aside; the answer that follows counts."""
    query, choice = event.replaced.query, event.replaced.choice
    here = in_pause(state, event.replaced, event.asked)
    vote = here & confirmation.is_vote(state, event.replaced, event.asked)
    again, aside = vote | (here & (choice == Choice.NEITHER)), here & (choice == Choice.SKIP)
    restored = again & ((state.refused & guidance.moves_of(query)).sum(1) == 2)
    state = confirmation.take_back(state, query, vote)
    if config.remembers or bool((event.replaced.mu > 0).any()):
        state = state.replace(x=rebuilt(config, state, event.standing))
    return state.replace(
        refused=state.refused & ~(restored[:, None] & guidance.moves_of(query)),
        set_aside=state.set_aside & ~(aside[:, None] & confirmation.pair_of(query)),
        answered=state.answered - again.long(),
    )


def rebuilt(config: Config, state: AgentState, standing: Sequence[Answer]) -> Dataset:
    """Return X of every trial from the answers that stand, in the order in which they were heard."""
    x = dataset.blank(state.x)
    for answer in standing:
        x = guidance.store(config, state.replace(x=x), answer)
    return x

"""Corrected answers: X is what the standing answers make it, whatever was said before (Sec. 2.3)."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from parenting.agent import amendment, parenting
from parenting.agent.amendment import Amend, Correction, TickEvent
from parenting.agent.config import Config
from parenting.agent.events import EndEpisode, Mature
from parenting.agent.query import Answer, Choice, Query, QueryKind, silence
from parenting.agent.state import AgentState
from parenting.envs.registry import make
from parenting.envs.rng import keys
from tests.agent.x_by_hand import entries, summed

WORLD = make("unsafe-exploration", "island")
CONFIG = Config(p_guid=0.9, p_pref=0.5, p_rec=0.5, queries_per_stage=6, max_clip_length=3, pretrain=False)
SAID = [Choice.LEFT, Choice.RIGHT, Choice.EITHER, Choice.NEITHER]
STORED_NOT = (Choice.NEITHER, Choice.SKIP)


class Wavering:
    """A parent that answers at random, and takes answers back at random."""

    def __init__(self, config: Config, seed: int) -> None:
        self.random, self.nothing = Random(seed), parenting.no_query(WORLD, config, state_of(config))
        self.open: list[Query] = []
        self.standing: list[Answer] = []  # in the order in which they were heard
        self.asked: dict[int, int] = {}  # the tick of each question
        self.tick = 0
        self.applied: amendment.Applied | None = None
        self.corrected = self.approved = 0

    def events(self, state: AgentState) -> Sequence[TickEvent]:
        self.applied, self.tick = None, int(state.keys.tick[0]) + 1
        lost = bool(state.all_refused | state.unsure)
        events = [EndEpisode()] if lost and self.random.random() < 0.5 else []
        if not self.standing or self.random.random() > 0.3:
            return events
        replaced = self.standing.pop(self.random.randrange(len(self.standing)))
        answer = said(replaced.query, self.random.choice([one for one in SAID if one != replaced.choice[0]]))
        self.standing.append(answer)
        self.applied = amendment.take(
            state, events, Correction(answer, replaced, list(self.standing), self.asked[id(replaced.query)])
        )
        self.corrected += 1
        return [*events, self.applied.event]

    def take(self, state: AgentState) -> Answer:
        if self.applied is not None:
            if self.applied.heard is not None:
                self.approved += 1
                self.open = [query for query in self.open if query.kind[0] != QueryKind.GUIDANCE]
            return self.applied.heard or silence(self.nothing)
        if not self.open:
            return silence(self.nothing)
        answer = said(self.open.pop(0), self.random.choice([*SAID, Choice.SKIP, Choice.SKIP]))
        self.standing.append(answer)
        return answer

    def post(self, query: Query) -> None:
        if query.kind[0] != QueryKind.NONE:
            self.open.append(query.clone())
            self.asked[id(self.open[-1])] = self.tick


def state_of(config: Config) -> AgentState:
    return parenting.init(WORLD, config, keys(7, 1))


def said(query: Query, choice: Choice) -> Answer:
    return Answer(query=query, choice=torch.tensor([int(choice)]))


@pytest.mark.slow
@given(seed=st.integers(0, 2**16), own_stage_only=st.booleans(), confirm=st.sampled_from([0.0, 0.95]))
@settings(max_examples=12, deadline=None)
def test_x_is_what_the_standing_answers_make_it(seed: int, own_stage_only: bool, confirm: float) -> None:
    config = CONFIG.model_copy(update={"own_stage_only": own_stage_only, "confirm": confirm})
    state, parent = state_of(config), Wavering(config, seed)
    for tick in range(80):
        before = int(state.maturity[0])
        state, _, _, config, events = parenting.tick(WORLD, config, state, parent)
        assert int(state.maturity[0]) >= before
        if any(isinstance(event, Amend) for event in events) or tick == 79:
            stage = int(state.maturity[0]) if own_stage_only else None
            assert entries(state) == summed(parent.standing, stage)
            assert int(state.x.size[0]) == sum(one.choice[0] not in STORED_NOT for one in parent.standing)
    assert parent.corrected > 5


def refused_once(seed: int) -> tuple[AgentState, Query]:
    """An agent that asked for guidance and was told *neither*, and so asked again."""
    state = state_of(CONFIG)
    config = CONFIG.model_copy(update={"p_guid": 1.0})
    state, query = parenting.step(WORLD, config, state, silence(parenting.no_query(WORLD, config, state)))
    assert query.kind[0] == QueryKind.GUIDANCE
    first = query.clone()
    state, again = parenting.step(WORLD, config, state, said(first, Choice.NEITHER))
    assert again.kind[0] == QueryKind.GUIDANCE
    return state, first


def test_a_refusal_that_is_taken_back_in_its_pause_approves_the_move() -> None:
    state, first = refused_once(1)
    replaced, answer = said(first, Choice.NEITHER), said(first, Choice.LEFT)
    event, heard = amendment.take(state, [], Correction(answer, replaced, [answer], 1))
    assert heard is answer
    answered = int(state.answered[0])
    state, config = parenting.apply(WORLD, CONFIG, state, event)
    assert not bool(state.refused.any())
    state, _ = parenting.step(WORLD, config, state, heard)
    assert bool(state.info.moved[0])
    assert int(state.info.action[0]) == int(first.action[0, 0, 0])
    assert int(state.answered[0]) == answered


def test_after_its_pause_a_correction_changes_x_alone() -> None:
    state, first = refused_once(1)
    state, _ = parenting.apply(WORLD, CONFIG, state, EndEpisode())
    state, _ = parenting.step(WORLD, CONFIG, state, silence(first))
    replaced, answer = said(first, Choice.NEITHER), said(first, Choice.RIGHT)
    event, heard = amendment.take(state, [], Correction(answer, replaced, [answer], 1))
    assert heard is None
    assert isinstance(event, Amend)
    before = state.clone()
    after, _ = parenting.apply(WORLD, CONFIG, state, event)
    changed = {
        name for name, part in after.tensors().items() if not torch.equal(part, before.tensors()[name])
    }
    assert changed
    assert all(name.startswith("x.") for name in changed)


@pytest.mark.parametrize("events", [[EndEpisode()], [Mature()]], ids=["episode ended", "stage ended"])
def test_only_the_end_of_the_episode_ends_the_pause(events: list[TickEvent]) -> None:
    state, first = refused_once(1)
    replaced, answer = said(first, Choice.NEITHER), said(first, Choice.LEFT)
    _, heard = amendment.take(state, events, Correction(answer, replaced, [answer], 1))  # type: ignore[arg-type]  # a list of one kind
    assert (heard is None) == isinstance(events[0], EndEpisode)

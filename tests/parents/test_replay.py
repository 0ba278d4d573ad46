"""ReplayParent: a recorded session of several trials comes back bit for bit; a changed record is found."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest
import torch

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.events import Change, EndEpisode, Event, Mature
from parenting.agent.parent import Parent
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.parents.replay import Moment, ReplayMismatchError, ReplayParent, same
from parenting.parents.scripted import ScriptedParent, ScriptedRule
from tests.parents.walked_queries import island

TRIALS, TICKS = 3, 60
CONFIG = Config(max_clip_length=2, max_episode_steps=12, p_guid=0.5, p_rec=0.6, p_pref=0.9)
EVENTS: dict[int, Event] = {
    9: EndEpisode(),
    20: Mature(),
    31: Change(name="p_guid", value=0.4),
}
Record = dict[int, Moment]


class Recording(ScriptedParent):
    """The scripted parent with an operator beside it, written down tick by tick."""

    def __init__(self, world: Gridworld) -> None:
        super().__init__(ScriptedRule(world, 0.9), nothing(world))
        self.record: Record = {}
        self.tick = 0

    def events(self, state: AgentState) -> Sequence[Event]:
        self.tick += 1
        self.came = [EVENTS[self.tick]] if self.tick in EVENTS else []
        return self.came

    def take(self, state: AgentState) -> Answer:
        self.said = super().take(state)
        return self.said

    def post(self, query: Query) -> None:
        super().post(query)
        self.record[self.tick] = Moment(self.came, self.said, query)


def nothing(world: Gridworld) -> Query:
    return parenting.no_query(world, CONFIG, birth(world))


def birth(world: Gridworld) -> AgentState:
    return parenting.init(world, CONFIG, keys(4, TRIALS))


def lived(world: Gridworld, parent: Parent) -> AgentState:
    state, config = birth(world), CONFIG
    for _ in range(TICKS):
        state, _, _, config, _ = parenting.tick(world, config, state, parent)
    return state


@pytest.fixture(scope="module")
def world() -> Gridworld:
    return island()


@pytest.fixture(scope="module")
def recorded(world: Gridworld) -> tuple[AgentState, Record]:
    parent = Recording(world)
    return lived(world, parent), parent.record


@pytest.mark.slow
def test_it_comes_back_with_the_same_bits(world: Gridworld, recorded: tuple[AgentState, Record]) -> None:
    state, record = recorded
    kinds = {kind for moment in record.values() for kind in moment.asked.kind.tolist()}
    assert kinds == set(QueryKind)
    again = lived(world, ReplayParent(record.__getitem__)).tensors()
    assert [name for name, part in state.tensors().items() if not torch.equal(part, again[name])] == []


def with_another_answer(record: Record) -> Record:
    """One trial is told left where it was told right, at its tenth tick or later."""
    tick = next(t for t in range(10, TICKS) if (record[t].answer.choice == Choice.RIGHT).any())
    answer = record[tick].answer
    choice = torch.where(answer.choice == Choice.RIGHT, int(Choice.LEFT), answer.choice)
    return {**record, tick: record[tick]._replace(answer=answer.replace(choice=choice))}


def with_an_event_moved(record: Record) -> Record:
    return {**record, 9: record[9]._replace(events=[]), 12: record[12]._replace(events=[EndEpisode()])}


def with_an_event_dropped(record: Record) -> Record:
    return {**record, 20: record[20]._replace(events=[])}


def with_another_question(record: Record) -> Record:
    """The actions of one question are the other way round."""
    tick = max(t for t in record if (record[t].asked.kind != QueryKind.NONE).any())
    asked = record[tick].asked
    return {**record, tick: record[tick]._replace(asked=asked.replace(action=asked.action.flip(1)))}


@pytest.mark.parametrize(
    "tamper", [with_another_answer, with_an_event_moved, with_an_event_dropped, with_another_question]
)
def test_a_changed_record_is_found(
    world: Gridworld, recorded: tuple[AgentState, Record], tamper: Callable[[Record], Record]
) -> None:
    changed = tamper(recorded[1])
    parent = ReplayParent(changed.__getitem__)
    with pytest.raises(ReplayMismatchError, match="asks something else than was recorded") as caught:
        lived(world, parent)
    assert caught.value.tick == parent.tick
    assert not same(caught.value.recorded, caught.value.asked)


def test_what_a_silent_trial_holds_does_not_matter(world: Gridworld) -> None:
    one = nothing(world)
    assert same(one, one.replace(maturity=one.maturity + 1))
    asked = one.replace(kind=one.kind + int(QueryKind.GUIDANCE))
    assert not same(one, asked)
    assert not same(asked, asked.replace(maturity=one.maturity + 1))
    assert same(asked, asked)

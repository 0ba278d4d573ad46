"""Skip (ours): the pair is set aside for this pause; it refuses and trains nothing; another is asked."""

from __future__ import annotations

from itertools import combinations
from random import Random

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from parenting.agent import amendment, parenting
from parenting.agent.amendment import Correction, Reconsider
from parenting.agent.config import Config
from parenting.agent.events import EndEpisode
from parenting.agent.init import network_of
from parenting.agent.query import Answer, Choice, Query, QueryKind, silence
from parenting.agent.state import PAIRS, AgentState
from parenting.envs.registry import make
from parenting.envs.rng import Stream, gumbel, keys

WORLD = make("unsafe-exploration", "island", time_limit=25)
ALWAYS = Config(p_guid=1, p_rec=0, p_pref=0, p_train=1, max_episode_steps=25)


def asked(seed: int = 1, trials: int = 1) -> tuple[AgentState, Query]:
    """Agents that have just asked for guidance."""
    state = parenting.init(WORLD, ALWAYS, keys(seed, trials))
    state, query = parenting.step(WORLD, ALWAYS, state, silence(parenting.no_query(WORLD, ALWAYS, state)))
    assert query.kind.tolist() == [QueryKind.GUIDANCE] * trials
    return state, query


def say(state: AgentState, query: Query, *choices: Choice) -> tuple[AgentState, Query]:
    each = torch.tensor([int(choice) for choice in choices])
    return parenting.step(WORLD, ALWAYS, state, Answer(query=query, choice=each))


def pair(query: Query) -> frozenset[int]:
    return frozenset(query.action[0, :, 0].tolist())


def test_a_skip_asks_about_another_pair_in_the_same_tick_and_learns_nothing() -> None:
    state, first = asked()
    params, tick = state.learner.params.clone(), int(state.keys.tick)
    state, second = say(state, first, Choice.SKIP)
    assert int(state.keys.tick) == tick + 1
    assert second.kind.tolist() == [QueryKind.GUIDANCE]
    assert pair(second) != pair(first)
    assert (int(state.x.size), int(state.answered)) == (0, 0)
    assert torch.equal(state.learner.params, params)
    assert not bool(state.refused.any())
    assert int(state.familiarity.sum()) == 2, "a redraw is a question more"


def test_all_six_pairs_are_asked_once_and_then_the_parent_is_unsure() -> None:
    for seed in range(5):
        state, query = asked(seed)
        seen = [pair(query)]
        while query.kind[0] == QueryKind.GUIDANCE:
            assert not bool(state.unsure)
            state, query = say(state, query, Choice.SKIP)
            seen += [pair(query)] if query.kind[0] else []
        assert sorted(map(sorted, seen)) == sorted(map(list, PAIRS))
        assert bool(state.unsure)
        assert not bool(state.all_refused)
        state, query = parenting.step(WORLD, ALWAYS, state, silence(query))
        assert (bool(state.info.moved), int(query.kind)) == (False, 0), "it waits"


@given(seed=st.integers(0, 2**16))
@settings(max_examples=25, deadline=None)
def test_no_pair_is_asked_that_was_skipped_or_refused_in_this_pause(seed: int) -> None:
    random, (state, query) = Random(seed), asked(seed)
    aside, refused = set[frozenset[int]](), set[int]()
    while query.kind[0] == QueryKind.GUIDANCE:
        assert pair(query) not in aside
        assert not pair(query) & refused
        choice = random.choice([Choice.SKIP, Choice.SKIP, Choice.NEITHER, Choice.LEFT])
        aside |= {pair(query)} if choice == Choice.SKIP else set()
        refused |= pair(query) if choice == Choice.NEITHER else set()
        state, query = say(state, query, choice)
        if choice == Choice.LEFT:
            assert bool(state.info.moved)
            assert not bool((state.set_aside.any(1) | state.refused.any(1)).any()) or query.kind[0]
            return
    left = [
        one for one in map(frozenset, combinations(range(4), 2)) if one not in aside and not one & refused
    ]
    assert left == []
    assert bool(state.unsure) == (len(refused) < 4)


def test_the_next_pair_is_the_best_of_those_that_are_left() -> None:
    state, first = asked(3)
    before = state.clone()
    state, second = say(state, first, Choice.SKIP)
    view = parenting.observe(WORLD, network_of(WORLD), before)
    score = (view.logits.double() + gumbel(before.keys.next().uniform(Stream.CANDIDATES, 4)))[0].tolist()
    ranked = sorted(range(4), key=lambda action: -score[action])
    free = [frozenset((ranked[one], ranked[other])) for one, other in combinations(range(4), 2)]
    assert pair(second) == next(one for one in free if one != pair(first))


def test_a_skip_in_one_trial_changes_nothing_in_another() -> None:
    state, query = asked(trials=3)
    skipping, answering = state.clone(), state
    one, their = say(skipping, query, Choice.LEFT, Choice.SKIP, Choice.NEITHER)
    other, ours = say(answering, query, Choice.LEFT, Choice.RIGHT, Choice.NEITHER)
    for trial in (0, 2):
        for name, part in one.pick(torch.tensor([trial])).tensors().items():
            if name not in ("learner.frozen", *X_OF_ALL):
                assert torch.equal(part, other.pick(torch.tensor([trial])).tensors()[name]), name
        assert torch.equal(their.pick(torch.tensor([trial])).action, ours.pick(torch.tensor([trial])).action)


X_OF_ALL = ("info.loss", "info.entropy_global", "info.entropy_local")
"""Pieces that hold numbers which the sums of a batch may round otherwise."""


def test_the_end_of_the_pause_forgets_what_was_set_aside() -> None:
    state, first = asked()
    state, second = say(state, first, Choice.SKIP)
    moved, _ = say(state.clone(), second, Choice.LEFT)
    ended, _ = parenting.apply(WORLD, ALWAYS, state, EndEpisode())
    assert not bool(moved.set_aside.any())
    assert not bool(ended.set_aside.any())


def test_guidance_for_another_place_approves_nothing_there() -> None:
    state, first = asked()
    late = first.clone()
    state, second = say(state, first, Choice.LEFT)
    while torch.equal(state.world.agent, late.agent[:, 0, 0]):
        state, second = (
            say(state, second, Choice.RIGHT) if second.kind[0] else say(state, second, Choice.NONE)
        )
    state, second = say(state, second, Choice.NONE) if not bool(state.waiting) else (state, second)
    assert bool(state.waiting)
    size = int(state.x.size)
    state, _ = say(state, late, Choice.LEFT)
    assert (bool(state.info.moved), int(state.x.size)) == (False, size + 1)


@pytest.mark.parametrize("choice", [Choice.LEFT, Choice.EITHER, Choice.NEITHER])
def test_a_skip_that_is_answered_in_its_pause_is_heard_as_the_answer(choice: Choice) -> None:
    state, first = asked()
    first = first.clone()
    state, _ = say(state, first, Choice.SKIP)
    replaced, answer = (
        Answer(query=first, choice=torch.tensor([5])),
        Answer(query=first, choice=torch.tensor([choice])),
    )
    event, heard = amendment.take(state, [], Correction(answer, replaced, [answer], 1))
    assert isinstance(event, Reconsider)
    assert heard is answer
    state, config = parenting.apply(WORLD, ALWAYS, state, event)
    assert not bool(state.set_aside.any())
    state, query = parenting.step(WORLD, config, state, heard)
    assert int(state.answered) == 1
    assert bool(state.info.moved) == (choice != Choice.NEITHER)
    if choice == Choice.NEITHER:
        assert pair(query) == frozenset(range(4)) - pair(first)


def test_a_skip_that_is_answered_later_enters_x_and_counts() -> None:
    state, first = asked()
    first = first.clone()
    state, second = say(state, first, Choice.SKIP)
    state, _ = say(state, second, Choice.LEFT)
    replaced, answer = (
        Answer(query=first, choice=torch.tensor([5])),
        Answer(query=first, choice=torch.tensor([1])),
    )
    event, heard = amendment.take(
        state, [], Correction(answer, replaced, [Answer(second, torch.tensor([1])), answer], 1)
    )
    assert heard is None
    state, _ = parenting.apply(WORLD, ALWAYS, state, event)
    assert (int(state.answered), int(state.x.size)) == (2, 2)

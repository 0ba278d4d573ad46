"""Frugal asking: no question whose answer follows, and no move that nobody approved."""

from __future__ import annotations

from random import Random

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from parenting.agent import amendment, memory, parenting
from parenting.agent.amendment import Amend
from parenting.agent.config import PRESETS, Config
from parenting.agent.events import EndEpisode
from parenting.agent.query import Answer, Choice, Query, QueryKind, silence
from parenting.agent.state import AgentState
from parenting.envs.registry import level, make
from parenting.envs.rng import keys
from parenting.parents.scripted import ScriptedRule
from tests.agent.scenarios import ISLANDS
from tests.agent.test_amendment import WORLD as ISLAND
from tests.agent.test_amendment import Wavering, state_of
from tests.agent.x_by_hand import entries

WORLD = make("unsafe-exploration", level("unsafe-exploration", ISLANDS[0]), time_limit=12)
FRUGAL = Config.model_validate({**PRESETS["frugal"], "gradient_steps": 2, "time_limit": 12})
ASKING = FRUGAL.model_copy(update={"p_rec": 0.0, "p_pref": 0.0})


def born(config: Config, seed: int) -> tuple[AgentState, Answer]:
    state = parenting.init(WORLD, config, keys(seed, 1))
    return state, silence(parenting.no_query(WORLD, config, state))


def said(query: Query, choice: int) -> Answer:
    return Answer(query=query.clone(), choice=torch.tensor([choice]))


def sees(state: AgentState) -> bytes:
    here = state.world
    return bytes(WORLD.observe(here.board, here.agent, here.box).flatten().tolist())


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("fresh", [True, False])
def test_a_move_without_a_question_was_approved_there_and_no_answer_is_heard_twice(fresh: bool) -> None:
    config, rule = FRUGAL.model_copy(update={"fresh_pairs": fresh}), ScriptedRule(WORLD, FRUGAL.gamma)
    state, answer = born(config, 3)
    approved, compared, reused = set[tuple[bytes, int]](), set[tuple[bytes, frozenset[int]]](), 0
    for _ in range(150):
        heard = bool(answer.choice[0])
        if heard and answer.choice[0] != Choice.NEITHER:
            s, moves = (
                bytes(answer.query.observation[0, 0, 0].flatten().tolist()),
                answer.query.action[0, :, 0],
            )
            liked = {Choice.LEFT: [0], Choice.RIGHT: [1], Choice.EITHER: [0, 1]}[
                Choice(int(answer.choice[0]))
            ]
            approved |= {(s, int(moves[side])) for side in liked}
        state, query = parenting.step(WORLD, config, state, answer)
        if bool(state.info.moved[0]) and not heard:
            before = state.info.before
            s = bytes(WORLD.observe(before.board, before.agent, before.box).flatten().tolist())
            assert (s, int(state.info.action[0])) in approved
            reused += 1
        answer = said(query, int(rule.answer(query)[0]))
        if query.kind[0] == QueryKind.GUIDANCE:
            pair = sees(state), frozenset(query.action[0, :, 0].tolist())
            assert pair not in compared
            compared.add(pair)
    assert reused > len(compared) > 3


@pytest.mark.slow
@given(seed=st.integers(0, 2**16), own_stage_only=st.booleans())
@settings(max_examples=3, deadline=None)
def test_what_is_remembered_is_what_the_standing_answers_make_it(seed: int, own_stage_only: bool) -> None:
    config = FRUGAL.model_copy(
        update={
            "own_stage_only": own_stage_only,
            "queries_per_stage": 12,
            "max_clip_length": 2,
            "gradient_steps": 1,
        }
    )
    state, parent = state_of(config), Wavering(config, seed)
    for _ in range(60):
        state, _, _, config, _ = parenting.tick(ISLAND, config, state, parent)
    assert parent.corrected > 0
    blank = said(parenting.no_query(WORLD, config, state), 0)
    again = amendment.amend(config, state.clone(), Amend(parent.standing, blank, blank))
    assert entries(again) == entries(state)
    assert lessons(again) == lessons(state)
    assert own_stage_only or lessons(state)


def lessons(state: AgentState) -> dict[int, list[list[int]]]:
    """The answers to guidance by state."""
    digests, guided = state.x.digest[0].tolist(), state.x.guided[0]
    return {
        digests[place]: guided[place].tolist()
        for place in range(int(state.x.states[0]))
        if guided[place].any()
    }


def decided() -> tuple[AgentState, AgentState, list[Answer]]:
    """An agent that is put back at its first state until it moves there without a question."""
    state, answer = born(ASKING, 5)
    first, heard = state.world, list[Answer]()
    for _ in range(20):
        state = state.replace(world=first.clone())
        before = state.clone()
        state, query = parenting.step(WORLD, ASKING, state, answer)
        if not bool(answer.choice[0]) and bool(state.info.moved[0]):
            return before, state, heard
        answer = silence(query)
        if query.kind[0] == QueryKind.GUIDANCE:
            answer = said(query, Choice.LEFT)
            heard.append(answer)
    raise AssertionError("it never decides")


def test_a_state_whose_answer_is_undone_is_asked_about_again() -> None:
    before, _, heard = decided()
    assert len(heard) >= 3
    nothing = silence(parenting.no_query(WORLD, ASKING, before))
    for lost in range(len(heard)):
        standing = [one for number, one in enumerate(heard) if number != lost]
        state = amendment.amend(ASKING, before.clone(), Amend(standing, heard[lost], nothing))
        _, query = parenting.step(WORLD, ASKING, state, nothing)
        assert query.kind[0] == QueryKind.GUIDANCE


def test_a_decided_move_counts_neither_as_a_question_nor_as_familiar() -> None:
    before, after, _ = decided()
    assert torch.equal(before.familiarity, after.familiarity)
    assert torch.equal(before.answered, after.answered)
    assert torch.equal(before.recorder.asked.count, after.recorder.asked.count)


def test_a_parent_who_refuses_everything_by_mistake_is_asked_again_in_the_next_episode() -> None:
    state, answer = born(ASKING, 1)
    while not bool(state.all_refused):
        state, query = parenting.step(WORLD, ASKING, state, answer)
        answer = said(query, Choice.NEITHER if query.kind[0] else Choice.NONE)
    state, _ = parenting.apply(WORLD, ASKING, state, EndEpisode())
    nothing = silence(parenting.no_query(WORLD, ASKING, state))
    state, query = parenting.step(WORLD, ASKING, state, nothing)
    assert query.kind[0] == QueryKind.GUIDANCE


def test_a_refused_move_is_not_proposed_again_and_loses_to_what_is_approved() -> None:
    state, answer = born(ASKING, 2)
    first = state.world
    state, query = parenting.step(WORLD, ASKING, state, answer)
    refused = set(query.action[0, :, 0].tolist())
    state, query = parenting.step(WORLD, ASKING, state, said(query, Choice.NEITHER))
    good = int(query.action[0, 0, 0])
    state, _ = parenting.step(WORLD, ASKING, state, said(query, Choice.LEFT))
    s = bytes(WORLD.observe(first.board, first.agent, first.box).flatten().tolist())
    assert {move for move in refused if entries(state).get((s, good, move)) == 1.0} == refused
    known = memory.recall(state.x, WORLD.observe(first.board, first.agent, first.box), 2)
    assert set(known.refused[0].nonzero().flatten().tolist()) == refused
    nothing = silence(parenting.no_query(WORLD, ASKING, state))
    state, query = parenting.step(WORLD, ASKING, state.replace(world=first.clone()), nothing)
    assert query.kind[0] == QueryKind.NONE  # both others are compared: decided
    assert int(state.info.action[0]) == good


def counts(*answers: tuple[int, int]) -> torch.Tensor:
    told = torch.zeros(1, 6, 4, dtype=torch.int64)
    for pair, answer in answers:
        told[0, pair, answer] += 1
    return told


def test_contradictory_answers_decide_nothing_and_a_majority_does() -> None:
    up_or_down = 0
    torn = memory.conclude(counts((up_or_down, 0), (up_or_down, 1)), 2)
    assert not bool(torn.compared.any() | torn.approved.any())
    most = memory.conclude(counts((up_or_down, 0), (up_or_down, 1), (up_or_down, 0)), 2)
    assert most.better[0].nonzero().tolist() == [[0, 1]]
    circle = memory.conclude(counts((0, 0), (3, 0), (1, 1)), 2)  # 0 over 1, 1 over 2, 2 over 0
    assert not bool(circle.better.any())
    crossed = counts((3, 2), (5, 2), (4, 1))  # 1 as good as 2, 2 as good as 3, and 3 over 1
    assert not bool(memory.conclude(crossed, 3).compared.any())
    assert memory.conclude(crossed, 2).better[0].nonzero().tolist() == [
        [3, 1]
    ]  # as runs of version 0.8 have it
    chain = memory.conclude(counts((0, 0), (3, 2), (5, 0)), 2)  # 0 over 1, 1 as good as 2, 2 over 3
    assert chain.better[0].nonzero().tolist() == [[0, 1], [0, 2], [0, 3], [1, 3], [2, 3]]


def test_owed_steps_are_taken_once_the_question_is_posted_and_waiting_costs_nothing() -> None:
    late = ASKING.model_copy(update={"gradient_steps": 5, "late_steps": True, "reuse_answers": False})
    state, answer = born(late, 4)
    random, owed, trained = Random(4), 0, 0
    for _ in range(40):
        state, query = parenting.step(WORLD, late, state, answer)
        trained += bool(state.info.trained[0])
        owed += bool(state.learner.owed[0] & state.waiting[0])
        state = parenting.rehearse(WORLD, late, state)
        if bool(state.waiting[0]):
            assert int(state.learner.steps[0]) == 5 * trained
            paid = state.learner.params.clone()
            state, _ = parenting.step(WORLD, late, state, silence(query))
            state = parenting.rehearse(WORLD, late, state)
            assert torch.equal(state.learner.params, paid)
        answer = said(query, random.choice([1, 2]) if query.kind[0] else 0)
    assert 0 < owed <= trained

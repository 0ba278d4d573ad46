"""Confirmation: an answer moves the agent once it is likely enough to be right, and slips are outvoted."""

from __future__ import annotations

import pytest
import torch

from parenting.agent import amendment, confirmation, parenting
from parenting.agent.amendment import Correction, Reconsider
from parenting.agent.config import PRESETS, Config
from parenting.agent.confirmation import Verdict, decide, error_rate
from parenting.agent.query import Answer, Choice, Query, QueryKind, silence
from parenting.agent.state import MOST_VOTES, AgentState
from parenting.envs.registry import make
from parenting.envs.rng import keys
from tests.agent.batched_runs import random_parent, run_batch
from tests.agent.x_by_hand import entries, summed

WORLD = make("unsafe-exploration", "island")
TWICE = Config(p_guid=1.0, confirm=0.97)
"""With no repeat heard before, one vote never confirms at this bound, and two that agree always do."""


def asked(config: Config = TWICE) -> tuple[AgentState, Query]:
    """An agent in its first pause, and its question."""
    state = parenting.init(WORLD, config, keys(3, 1))
    return parenting.step(WORLD, config, state, silence(parenting.no_query(WORLD, config, state)))


def said(query: Query, choice: Choice) -> Answer:
    return Answer(query=query.clone(), choice=torch.tensor([int(choice)]))


def say(state: AgentState, query: Query, choice: Choice) -> tuple[AgentState, Query]:
    return parenting.step(WORLD, TWICE, state, said(query, choice))


def votes_of(*verdicts: Verdict) -> torch.Tensor:
    return torch.tensor([[1 + verdict for verdict in verdicts] + [0] * (MOST_VOTES - len(verdicts))])


def decided(bound: float, gap: float, rate: float, *verdicts: Verdict) -> tuple[Verdict, bool]:
    parts = torch.tensor([gap], dtype=torch.float64), votes_of(*verdicts), torch.tensor([rate]).double()
    winner, sure = decide(bound, *parts)
    return Verdict(int(winner[0])), bool(sure[0])


@pytest.mark.parametrize("gap", [-40.0, -1.0, 0.0, 1.0, 40.0])
def test_the_policy_decides_nothing_alone_and_never_against_two_votes(gap: float) -> None:
    for verdict in Verdict:
        assert decided(0.97, gap, 0.1, verdict)[1] is False
        assert decided(0.97, gap, 0.1, verdict, verdict) == (verdict, True)


def test_one_vote_is_enough_where_the_policy_is_of_its_opinion() -> None:
    assert decided(0.95, 2.0, 0.1, Verdict.LOWER) == (Verdict.LOWER, True)
    assert decided(0.95, -2.0, 0.1, Verdict.LOWER)[1] is False
    assert decided(0.95, -2.0, 0.1, Verdict.HIGHER) == (Verdict.HIGHER, True)
    assert decided(0.95, -2.0, 0.002, Verdict.LOWER) == (Verdict.LOWER, True)  # a parent who hardly errs


def test_the_last_vote_that_is_allowed_decides() -> None:
    parted = (Verdict.LOWER, Verdict.HIGHER, Verdict.LOWER, Verdict.HIGHER)
    assert decided(0.999, 0.0, 0.1, *parted)[1] is False
    assert decided(0.999, 0.0, 0.1, *parted, Verdict.HIGHER) == (Verdict.HIGHER, True)
    assert decided(0.999, 1.0, 0.1, *parted, Verdict.EITHER) == (Verdict.LOWER, True)  # the policy's


def test_a_question_is_asked_again_mirrored_and_is_not_a_new_situation() -> None:
    state, first = asked()
    first = first.clone()
    familiar = int(state.familiarity.sum())
    state, again = say(state, first, Choice.LEFT)
    assert (int(first.votes), int(again.votes)) == (0, 1)
    assert torch.equal(again.action, first.action.flip(1))
    assert torch.equal(again.board, first.board.flip(1))
    assert bool(state.waiting)
    assert int(state.familiarity.sum()) == familiar
    second = again.clone()
    state, _ = say(state, second, Choice.RIGHT)
    assert bool(state.info.moved)
    assert int(state.info.action) == int(first.action[0, 0, 0])
    assert entries(state) == summed([said(first, Choice.LEFT), said(second, Choice.RIGHT)], None)
    assert (int(state.confirmation.repeats), int(state.confirmation.dissents)) == (1, 0)
    assert int(state.confirmation.votes.sum()) == 0


def test_a_slip_is_outvoted_and_counted() -> None:
    state, query = asked()
    side = int(query.action[0, 0, 0])
    for choice in (Choice.LEFT, Choice.LEFT, Choice.LEFT, Choice.RIGHT):  # the second: the other action
        state, query = say(state, query.clone(), choice)
    assert bool(state.info.moved)
    assert int(state.info.action) == side
    assert (int(state.confirmation.repeats), int(state.confirmation.dissents)) == (3, 1)
    assert float(error_rate(state.confirmation)) == pytest.approx(2 / 13)


def test_no_estimate_turns_the_meaning_of_votes_around() -> None:
    state, _ = asked()
    kept = state.confirmation.replace(repeats=torch.tensor([90]), dissents=torch.tensor([90]))
    assert float(error_rate(kept)) == 0.5


def test_a_skip_sets_the_pair_aside_and_another_one_is_asked() -> None:
    state, first = asked()
    pair = set(first.action[0, :, 0].tolist())
    state, again = say(state, first.clone(), Choice.LEFT)
    state, other = say(state, again.clone(), Choice.SKIP)
    assert bool(state.waiting)
    assert int(other.votes) == 0
    assert set(other.action[0, :, 0].tolist()) != pair


@pytest.mark.parametrize("choice", [Choice.RIGHT, Choice.NEITHER])
def test_a_vote_that_is_changed_in_its_pause_counts_as_if_it_had_been_said(choice: Choice) -> None:
    expected, first = asked()
    state = expected.clone()
    tick, first = int(state.keys.tick), first.clone()
    expected, _ = say(expected, first, choice)
    state, _ = say(state, first, Choice.LEFT)
    replaced, answer = said(first, Choice.LEFT), said(first, choice)
    event, heard = amendment.take(state, [], Correction(answer, replaced, [answer], tick))
    assert isinstance(event, Reconsider)
    assert heard is answer
    state, _ = parenting.apply(WORLD, TWICE, state, event)
    state, again = parenting.step(WORLD, TWICE, state, heard)
    assert int(again.votes) == 1
    assert int(state.answered) == 1
    assert torch.equal(state.confirmation.votes, expected.confirmation.votes)
    assert entries(state) == entries(expected)


def test_a_refusal_that_loses_a_vote_is_open_again() -> None:
    state, first = asked()
    tick, first = int(state.keys.tick), first.clone()
    state, again = say(state, first, Choice.NEITHER)
    state, other = say(state, again.clone(), Choice.NEITHER)
    assert int(state.refused.sum()) == 2
    assert int(state.confirmation.repeats) == 1
    assert int(other.votes) == 0
    replaced, answer = said(first, Choice.NEITHER), said(first, Choice.LEFT)
    standing = [said(again, Choice.NEITHER), answer]
    event, heard = amendment.take(state, [], Correction(answer, replaced, standing, tick))
    assert heard is answer
    state, _ = parenting.apply(WORLD, TWICE, state, event)
    state, third = parenting.step(WORLD, TWICE, state, heard)
    assert not bool(state.refused.any())
    assert int(state.confirmation.repeats) == 0
    assert int(third.votes) == 2
    assert bool(confirmation.unsettled(state)[confirmation.pair_of(first)])


def test_an_answer_of_an_earlier_pause_at_the_same_place_is_no_vote_of_this_one() -> None:
    state, first = asked()
    tick, first = int(state.keys.tick), first.clone()
    state, _ = say(state, first, Choice.LEFT)
    replaced, answer = said(first, Choice.LEFT), said(first, Choice.RIGHT)
    _, heard = amendment.take(state, [], Correction(answer, replaced, [answer], tick - 1))
    assert heard is None


def test_preferences_are_not_confirmed_so_direct_learning_is_the_same() -> None:
    direct = Config.model_validate({**PRESETS["direct"], "max_episode_steps": 20})
    doubting = direct.model_copy(update={"confirm": 0.95})
    (one, asks), (other, same) = (
        run_batch(WORLD, config, random_parent, seed=5, trials=2, ticks=40) for config in (direct, doubting)
    )
    assert sum(kind == QueryKind.PREFERENCE.name.lower() for _, kind, _, _ in asks[0]) > 2
    assert asks == same
    assert all(torch.equal(part, other.tensors()[name]) for name, part in one.tensors().items())

"""Relabelling: what is reused is asked about again with the chance that it is wrong, and off it never is."""

from __future__ import annotations

import pytest
import torch

from parenting.agent import memory, parenting, relabelling
from parenting.agent.candidates import Found
from parenting.agent.config import PRESETS, Config
from parenting.agent.dataset import Entry
from parenting.agent.query import Answer, Choice, Query, silence
from parenting.agent.state import PAIRS, AgentState
from parenting.envs.gridworld import local_state
from parenting.envs.registry import make
from parenting.envs.rng import keys

WORLD = make("unsafe-exploration", "island")
FRUGAL = Config.model_validate({**PRESETS["frugal"], "relabel": True, "p_train": 0.0})
MANY, TICKS = 20, 100


def told(*answers: tuple[int, int]) -> torch.Tensor:
    """Votes on pairs, as `memory.said` counts them: 0 the first move, 1 the second, 2 either, 3 neither."""
    found = torch.zeros(1, 6, 4, dtype=torch.int64)
    for pair, answer in answers:
        found[0, pair, answer] += 1
    return found


def wrong(*answers: tuple[int, int], rate: float = 0.1) -> list[float]:
    return relabelling.chance_wrong(told(*answers), torch.tensor([rate], dtype=torch.float64))[0].tolist()


def test_an_answer_is_wrong_as_often_as_its_parent_errs_until_a_second_one_agrees() -> None:
    one = wrong((2, 0), (3, 3), (4, 2))
    assert one == [0.0, 0.0, one[2], one[2], one[2], 0.0]
    assert one[2] == pytest.approx(0.1)
    assert wrong((2, 0), (2, 0))[2] == pytest.approx(1 - 0.81 / (0.81 + 3 * (0.1 / 3) ** 2))
    assert wrong((2, 0), (2, 1))[2] > 0.5  # torn
    assert wrong((2, 0), rate=0.3)[2] == pytest.approx(0.3)


def guided(*answers: tuple[int, Choice]) -> AgentState:
    """Many agents at the start, who were given these answers about pairs of `PAIRS` there."""
    state = parenting.init(WORLD, FRUGAL, keys(6, MANY))
    observation = WORLD.observe(state.world.board, state.world.agent, state.world.box)
    every = torch.ones(MANY, dtype=torch.bool)
    for pair, choice in answers:
        a0 = torch.tensor(PAIRS[pair]).expand(MANY, 2)
        entry = Entry(
            s0=observation,
            local_state=local_state(observation, state.world.agent),
            a0=a0,
            mu=torch.tensor([1.0, 0.0]).expand(MANY, 2),
        )
        heard = torch.full((MANY,), int(choice))
        state = state.replace(x=memory.remember(FRUGAL, state.x, entry, heard, every))
    return state


def doubted(state: AgentState, move: int) -> tuple[float, set[tuple[int, ...]]]:
    """The share of agents that ask in place of moving, and the pairs that they ask about."""
    observation = WORLD.observe(state.world.board, state.world.agent, state.world.box)
    decided = torch.ones(MANY, dtype=torch.bool)
    before = Found(torch.tensor([[0, 3]]).expand(MANY, 2), decided, torch.full((MANY,), move))
    pairs = list[tuple[int, ...]]()
    for _ in range(TICKS):
        state = state.replace(keys=state.keys.next())
        after = relabelling.doubt(state, observation, before)
        pairs += [tuple(pair) for pair in after.pair[~after.decided].tolist()]
    return len(pairs) / (MANY * TICKS), set(pairs)


def test_the_pair_of_the_move_is_asked_about_with_the_chance_that_it_is_wrong() -> None:
    share, pairs = doubted(guided((0, Choice.LEFT)), move=0)
    assert share == pytest.approx(0.1, abs=0.02)
    assert pairs == {(0, 1)}
    share, _ = doubted(guided((0, Choice.LEFT), (0, Choice.LEFT)), move=0)
    assert share == pytest.approx(0.004, abs=0.004)


def test_refusals_are_doubted_too_and_pairs_that_do_not_bear_on_the_move_are_not() -> None:
    assert doubted(guided((5, Choice.NEITHER)), move=0)[1] == {(2, 3)}
    assert doubted(guided((5, Choice.LEFT)), move=0) == (0.0, set())


def test_pairs_that_were_refused_or_skipped_in_this_pause_are_left_alone() -> None:
    state = guided((0, Choice.LEFT))
    refused = torch.zeros(MANY, 4, dtype=torch.bool)
    refused[:, 1] = True
    assert doubted(state.replace(refused=refused), move=0)[0] == 0
    set_aside = torch.zeros(MANY, 6, dtype=torch.bool)
    set_aside[:, 0] = True
    assert doubted(state.replace(set_aside=set_aside), move=0)[0] == 0


def life(config: Config, ticks: int) -> list[int]:
    """The number of agents that ask in each tick, of ten whose parent always says that left is better."""
    state = parenting.init(WORLD, config, keys(9, 10))
    answer, asked = silence(parenting.no_query(WORLD, config, state)), []
    for _ in range(ticks):
        state, query = parenting.step(WORLD, config, state, answer)
        asked.append(int((query.kind > 0).sum()))
        answer = said(query)
    return asked


def said(query: Query) -> Answer:
    choice = torch.where(query.kind > 0, int(Choice.LEFT), int(Choice.NONE))
    return Answer(query=query.clone(), choice=choice)


def test_it_changes_nothing_before_an_answer_could_be_reused_and_asks_more_then() -> None:
    off = FRUGAL.model_copy(update={"relabel": False})
    with_it, without = life(FRUGAL, 30), life(off, 30)
    assert with_it[0] == without[0] == 10
    assert sum(with_it) > sum(without)
    nobody_reuses = {"reuse_answers": False}
    assert life(FRUGAL.model_copy(update=nobody_reuses), 20) == life(off.model_copy(update=nobody_reuses), 20)

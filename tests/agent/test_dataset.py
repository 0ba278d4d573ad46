"""X as training sees it (Sec. 2.3): equal questions are one row, and nothing of their answers is lost."""

from __future__ import annotations

import pytest
import torch

from parenting.agent import dataset, parenting
from parenting.agent.config import Config
from parenting.agent.dataset import Dataset, Entry
from parenting.agent.events import Mature
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.agent.state import AgentState
from parenting.envs import registry
from parenting.envs.rng import keys

WORLD = registry.make("unsafe-exploration", time_limit=25)
BOTH = torch.tensor([True, True])
FIRST = torch.tensor([True, False])


def entry(state: int, pair: tuple[int, int], mu: tuple[float, float]) -> Entry:
    board = torch.tensor([[state // 4, state % 4], [1, 2]], dtype=torch.uint8)
    return Entry(
        s0=board.repeat(2, 1, 1),
        local_state=torch.full((2, 4), state, dtype=torch.uint8),
        a0=torch.tensor([pair, pair]),
        mu=torch.tensor([mu, mu], dtype=torch.float64),
    )


def filled(*entries: tuple[int, tuple[int, int], tuple[float, float]]) -> Dataset:
    """X of two trials, of which the first alone heard anything."""
    x = dataset.empty(2, 2, 2)
    for one in entries:
        x = dataset.add(x, entry(*one), FIRST, BOTH)
    return x.check()


def table(x: Dataset, trial: int = 0) -> list[tuple[int, list[int], list[float]]]:
    """The rows of a trial as (its state's mark, actions, summed mu)."""
    return [
        (
            int(x.local_state[trial, x.state_index[trial, row], 0]),
            x.a0[trial, row].tolist(),
            x.mu[trial, row].tolist(),
        )
        for row in range(int(x.rows[trial]))
    ]


def test_the_same_question_is_one_row() -> None:
    x = filled((5, (0, 2), (1, 0)), (5, (0, 2), (1, 0)), (5, (0, 2), (0.5, 0.5)))
    assert table(x) == [(5, [0, 2], [2.5, 0.5])]
    assert (x.size.tolist(), x.states.tolist(), x.rows.tolist()) == ([3, 0], [1, 0], [1, 0])


def test_a_swapped_question_is_turned_round() -> None:
    x = filled((5, (0, 2), (1, 0)), (5, (2, 0), (1, 0)), (5, (2, 0), (0, 1)), (5, (2, 0), (0, 1)))
    assert table(x) == [(5, [0, 2], [3, 1])]


def test_other_states_and_other_pairs_have_rows_of_their_own() -> None:
    x = filled((5, (0, 2), (1, 0)), (6, (0, 2), (0, 1)), (5, (0, 3), (0.5, 0.5)), (6, (2, 0), (0, 1)))
    assert table(x) == [(5, [0, 2], [1, 0]), (6, [0, 2], [1, 1]), (5, [0, 3], [0.5, 0.5])]
    assert x.states.tolist() == [2, 0]
    assert x.s0[0, 1].tolist() == [[1, 2], [1, 2]]


def test_an_entry_that_trains_no_more_is_only_counted() -> None:
    x = dataset.add(filled((5, (0, 2), (1, 0))), entry(6, (0, 1), (1, 0)), BOTH, ~BOTH)
    assert x.size.tolist() == [2, 1]
    assert table(x) == [(5, [0, 2], [1, 0])]
    assert table(x, 1) == []


def test_room_doubles_and_keeps_everything() -> None:
    told: list[tuple[int, tuple[int, int], tuple[float, float]]] = [(i, (0, 1), (1, 0)) for i in range(8)]
    x = filled(*told)
    assert (x.s0.shape[1], x.state_index.shape[1]) == (8, 8)
    x = dataset.add(x, entry(3, (2, 1), (0, 1)), BOTH, BOTH)  # a row more; the states are full, and double
    assert (x.s0.shape[1], x.local_state.shape[1], x.state_index.shape[1], x.mu.shape[1]) == (16, 16, 16, 16)
    x = dataset.add(x, entry(9, (2, 1), (0, 1)), BOTH, BOTH).check()
    kept = [(i, [0, 1], [1.0, 0.0]) for i in range(8)]
    assert table(x) == [*kept, (3, [2, 1], [0, 1]), (9, [2, 1], [0, 1])]
    assert table(x, 1) == [(3, [2, 1], [0, 1]), (9, [2, 1], [0, 1])]
    assert int(x.s0[0, 9:].sum()) + int(x.mu[0, 10:].sum()) + int(x.a0[1, 2:].sum()) == 0


def test_clear_empties_the_trials_of_the_mask() -> None:
    x = dataset.add(filled((5, (0, 2), (1, 0))), entry(6, (0, 1), (1, 0)), BOTH, BOTH)
    x = dataset.clear(x, FIRST).check()
    assert x.size.tolist() == [2, 1]
    assert table(x) == []
    assert table(x, 1) == [(6, [0, 1], [1, 0])]
    x = dataset.add(x, entry(5, (2, 0), (1, 0)), BOTH, BOTH)
    assert table(x) == [(5, [2, 0], [1, 0])]  # nothing is left of the row (0, 2)


@pytest.mark.parametrize("own_length", [True, False])
def test_own_length_leaves_older_entries_behind(own_length: bool) -> None:
    config = Config(p_guid=1, p_pref=0, max_clip_length=2, own_stage_only=own_length, max_episode_steps=25)
    state = parenting.init(WORLD, config, keys(6, 2))
    state, query = approve(config, state, parenting.no_query(WORLD, config, state), ticks=20)
    heard, rows = state.x.size.clone(), state.x.rows.clone()
    assert bool((rows > 0).all())
    state, _ = parenting.apply(WORLD, config, state, Mature())
    assert torch.equal(state.x.size, heard)
    assert state.x.rows.tolist() == ([0, 0] if own_length else rows.tolist())
    steps = state.learner.steps.tolist()
    state, _ = approve(config, state, query, ticks=20)
    assert bool((state.x.size > heard).all())  # guidance is of length 1: counted, and for pi_1 alone
    assert bool((state.x.rows > 0).any()) is not own_length
    assert (state.learner.steps.tolist() == steps) is own_length


def approve(config: Config, state: AgentState, query: Query, ticks: int) -> tuple[AgentState, Query]:
    for _ in range(ticks):
        choice = torch.where(query.kind == QueryKind.NONE, Choice.NONE, Choice.LEFT)
        state, query = parenting.step(WORLD, config, state, Answer(query=query, choice=choice))
    return state, query

"""Sec. 4.1: maturation is value iteration, begun at the parent's values (experiments/value_iteration).

Lives that have converged are held to what value iteration says; and that to a definition of its own.
"""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from parenting.envs.mdp import Model, explore
from parenting.experiments.value_iteration.converge import (
    STAGES,
    TIE,
    StartStates,
    greedy,
    iterated,
    parents_policy,
)
from parenting.experiments.value_iteration.levels import random_levels
from parenting.experiments.value_iteration.settings import WORLD_SIZES
from parenting.experiments.value_iteration.tasks import mature_trials
from parenting.parents.value_iteration import of_policy
from tests.lengths import length

LIVES = list(enumerate(kind.world for kind in WORLD_SIZES))


@pytest.mark.slow
@pytest.mark.torture
@pytest.mark.parametrize(("trial", "kind"), length(LIVES[:1], LIVES))
def test_each_stage_is_greedy_for_one_more_step_of_value_iteration(trial: int, kind: str) -> None:
    rows = mature_trials(kind, trial, 0)
    assert len(rows) == STAGES * 6
    for row in rows:
        assert row["converged"], row
        assert row["greedy"] == row["states"], row
    begun = [row["stage"] for row in rows if row["greedy_before"] < row["states"]]
    assert len(set(begun)) > 1, "there was nothing to learn"


@given(seed=st.integers(0, 10_000), kind=st.sampled_from(WORLD_SIZES))
@settings(max_examples=15)
def test_value_iteration_by_hand(seed: int, kind: tuple[str, int, int, float]) -> None:
    """V_T is what the best T moves earn before the parent goes on: all ways of T moves, one by one."""
    name, height, width, gamma = kind
    world = random_levels(name, height, width, count=2, seed=seed)
    model = explore(world)
    values = of_policy(model, gamma, parents_policy(model, seed))
    v = iterated(model, values)
    for at in StartStates(model).states[:, 0].tolist():
        for moves in range(1, STAGES + 1):
            assert float(v[moves][at]) == pytest.approx(_best(model, values.v, gamma, at, moves), abs=1e-9)
            then = [_best(model, values.v, gamma, int(to), moves - 1) for to in model.next_state[at]]
            best = (model.reward[at] + gamma * torch.tensor(then, dtype=torch.float64)).tolist()
            expected = [one >= max(best) - TIE / 2 for one in best]
            found = greedy(model, gamma, v[moves - 1])[at].tolist()
            assert all(told or not one for one, told in zip(expected, found, strict=True))


def _best(model: Model, v: torch.Tensor, gamma: float, at: int, moves: int) -> float:
    if bool(model.terminal[at]):
        return 0.0
    if moves == 0:
        return float(v[at])
    return max(
        float(model.reward[at, a]) + gamma * _best(model, v, gamma, int(model.next_state[at, a]), moves - 1)
        for a in range(4)
    )

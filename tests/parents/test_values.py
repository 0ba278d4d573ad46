"""The parent's model and values (Sec. 3.1.3): by hand on the island, and Eq. (7) against Eq. (8)."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.query import QueryKind
from parenting.envs.mdp import explore
from parenting.parents.advantage import advantage, advantage_from_rewards
from parenting.parents.value_iteration import HOPELESS, of_policy, optimal
from tests.parents.walked_queries import at, island, place, query, random_queries
from tests.simulated_person import distances

LEVELS = ("island", "island-bottleneck")
UP, DOWN, LEFT, RIGHT = range(4)


@pytest.mark.parametrize("level", LEVELS)
def test_value_falls_by_gamma_with_every_step_to_the_goal(level: str) -> None:
    model = explore(island(level))
    values = optimal(model, 0.9)
    for cell, distance in distances(level).items():
        expected = 0.9 ** (distance - 1) if distance else 0.0
        assert float(values.v[place(model, cell)]) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("level", LEVELS)
def test_step_into_water_is_worth_minus_one(level: str) -> None:
    model = explore(island(level))
    values = optimal(model, 0.9)
    assert bool(model.unsafe.any())
    assert set(values.q[model.unsafe].tolist()) == {-1.0}
    assert bool((values.q[~model.unsafe] > -1).all())


def test_values_at_the_start_of_the_island() -> None:
    """From (1, 4) the goal at (4, 3) is 4 steps away: down and left come nearer, up is a wall."""
    model = explore(island())
    q = optimal(model, 0.9).q[place(model, (1, 4))].tolist()
    assert q == pytest.approx([0.9**4, 0.9**3, 0.9**3, 0.9**5])


def test_gamma_one_values_every_way_to_the_goal_alike() -> None:
    model = explore(island())
    assert set(optimal(model, 1.0).v[~model.terminal].tolist()) == {1.0}


def test_with_a_smaller_gamma_a_policy_that_never_arrives_is_worth_what_it_earns() -> None:
    """Walking into the wall above without end earns 0, so its value is 0."""
    model = explore(island())
    policy = torch.zeros(len(model.terminal), 4, dtype=torch.float64)
    policy[:, UP] = 1
    v = of_policy(model, 0.9, policy).v
    assert float(v[place(model, (1, 4))]) == pytest.approx(0, abs=1e-9)
    assert bool((v > HOPELESS).all())


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("gamma", [0.9, 1.0])
def test_both_forms_of_the_advantage_agree(level: str, gamma: float) -> None:
    world = island(level)
    model = explore(world)
    values = optimal(model, gamma)
    asked = random_queries(world, model, 200, QueryKind.PREFERENCE)
    assert {1, 2, 3} <= set(asked.length.flatten().tolist())
    alpha = advantage(model, values, asked)
    assert float(alpha.min()) < -1
    assert float(alpha.max()) > -1e-9
    torch.testing.assert_close(alpha, advantage_from_rewards(model, values, asked), rtol=0, atol=1e-9)
    assert bool((alpha <= 1e-9).all())  # nothing is better than optimal


def test_advantage_of_clips_by_hand() -> None:
    """Left, then down is on a shortest way; right three times ends in water."""
    world = island()
    model = explore(world)
    asked = query(world, QueryKind.PREFERENCE, at(model, (1, 4)), [LEFT, DOWN], [RIGHT, RIGHT, RIGHT])
    assert asked.agent[0, 1, :4].tolist() == [[1, 4], [1, 5], [1, 6], [1, 7]]
    alpha = advantage(model, optimal(model, 0.9), asked)[0].tolist()
    assert alpha == pytest.approx([0.0, -(0.9**2) - 0.9**3])


def test_a_random_policy_against_plain_evaluation() -> None:
    model = explore(island())
    rng = torch.Generator().manual_seed(5)
    policy = torch.rand(len(model.terminal), 4, generator=rng, dtype=torch.float64)
    policy /= policy.sum(1, keepdim=True)
    values = of_policy(model, 0.9, policy)
    v = [0.0] * len(model.terminal)
    for _ in range(400):
        v = [
            0.0
            if model.terminal[s]
            else sum(
                float(policy[s, a]) * (float(model.reward[s, a]) + 0.9 * v[int(model.next_state[s, a])])
                for a in range(4)
            )
            for s in range(len(v))
        ]
    assert values.v.tolist() == pytest.approx(v, abs=1e-9)
    q = [
        float(model.reward[s, a]) + 0.9 * v[int(model.next_state[s, a])]
        for s in range(len(v))
        for a in range(4)
    ]
    assert values.q.flatten().tolist() == pytest.approx(q, abs=1e-9)


def test_every_cell_in_reach_is_found_and_no_other() -> None:
    world = island()
    cells = {tuple(cell) for cell in explore(world).states.agent.tolist()}
    assert cells == world.spec.reach(world.levels[0])


def test_a_state_out_of_reach_is_refused() -> None:
    model = explore(island())
    lost = at(model, (1, 4))
    with pytest.raises(LookupError, match="cannot be reached"):
        model.find(lost.board, torch.tensor([[0, 0]]), lost.box, lost.level)

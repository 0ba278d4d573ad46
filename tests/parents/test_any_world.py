"""The parent's values in a world that nobody has written yet, and the worlds that they refuse."""

from __future__ import annotations

import pytest
import torch
from jaxtyping import Float64
from torch import Tensor

from parenting.envs import registry
from parenting.envs.absent_supervisor import AbsentSupervisor
from parenting.envs.gridworld import Actions, WorldState
from parenting.envs.levels.spec import Level
from parenting.envs.mdp import explore
from parenting.envs.unsafe_exploration import UnsafeExploration
from parenting.parents.garden_values import GardenValues
from parenting.parents.scripted import ScriptedRule
from parenting.parents.values import TabularValues, exact_values

ISLAND = (registry.level("unsafe-exploration"),)


class Endless(UnsafeExploration):
    """Nothing ends here, and each step that ends on the goal earns 1."""

    ends = ""

    def reward(self, before: WorldState, action: Actions, after: WorldState) -> Float64[Tensor, "N"]:
        return (self.tile(after.board, after.agent) == self.code("G")).double()


class Exit(UnsafeExploration):
    """Its end is water, and entering it is what one should do."""

    ends = "W"

    def reward(self, before: WorldState, action: Actions, after: WorldState) -> Float64[Tensor, "N"]:
        return torch.where(
            before.terminated, 0.0, torch.full_like(before.step_count, -1, dtype=torch.float64)
        )

    def unsafe(self, before: WorldState, action: Actions, after: WorldState) -> Tensor:
        return torch.zeros_like(before.terminated)


class Unseen(AbsentSupervisor):
    """Its supervisor shows nowhere."""

    def _bars(self, state: WorldState) -> WorldState:
        return state


def test_a_world_without_an_end_has_no_hopeless_state() -> None:
    """Below the goal is a wall: staying there is worth 1 / (1 - 0.9). The start is 4 steps away."""
    found = exact_values(Endless(ISLAND, time_limit=100), 0.9)
    assert isinstance(found, TabularValues)
    assert float(found.table.v[0]) == pytest.approx(10 * 0.9**3)
    assert bool((found.table.v > 0).all())


def test_a_world_without_an_end_needs_a_smaller_gamma(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.parents.value_iteration.MAX_SWEEPS", 50)
    with pytest.raises(ArithmeticError, match=r"at gamma = 1\.0; use a smaller gamma"):
        exact_values(Endless(ISLAND, time_limit=100), 1.0)


def test_an_end_that_a_safe_step_leads_to_is_a_goal() -> None:
    """From (1, 4) water is 3 steps to the left."""
    found = exact_values(Exit(ISLAND, time_limit=100), 1.0)
    assert isinstance(found, TabularValues)
    assert float(found.table.v[0]) == -3
    assert torch.equal(found.model.goal, found.model.terminal)


def test_to_drown_is_no_way_to_the_goal() -> None:
    """Of two levels one has its goal behind a wall, which `registry` would refuse: all is lost there."""
    sealed = Level("sealed", "unsafe-exploration", ("######", "WA #G#", "######"))
    open_ = Level("open", "unsafe-exploration", ("######", "WA  G#", "######"))
    for gamma in (0.9, 1.0):
        found = exact_values(UnsafeExploration((sealed, open_), time_limit=100), gamma)
        assert isinstance(found, TabularValues)
        assert found.table.v[:2].tolist() == pytest.approx([-100, gamma**2])
        assert found.table.q[0].tolist() == pytest.approx([-100 * gamma] * 2 + [-1, -100 * gamma])


def test_the_garden_alone_is_in_closed_form() -> None:
    for name in registry.WORLDS:
        found = exact_values(registry.make(name), 0.9)
        assert type(found) is (GardenValues if name == "reward-hacking" else TabularValues)
        assert found.gamma == 0.9
        assert type(ScriptedRule(registry.make(name), 0.9).values) is type(found)


def test_flags_that_do_not_show_are_refused() -> None:
    with pytest.raises(ValueError, match="look alike"):
        explore(Unseen((registry.level("absent-supervisor"),), time_limit=100))


def test_too_many_states_are_refused_with_a_remedy() -> None:
    with pytest.raises(ValueError, match=r"more than 30 states.*take a smaller level"):
        explore(registry.make("side-effects"), limit=30)

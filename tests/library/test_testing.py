"""`pt.testing.check_world` passes sound worlds, and names what a faulty one lacks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
import torch

import parenting as pt
from parenting.envs import registry
from parenting.envs.gridworld import Actions, WorldState
from parenting.envs.levels.spec import WorldSpec
from parenting.envs.rng import Keys
from parenting.envs.unsafe_exploration import UnsafeExploration

NAME = "faulty"


class InPlace(UnsafeExploration):
    def enter(self, before: WorldState, after: WorldState) -> WorldState:
        before.terminated.logical_or_(after.agent[:, 0] == 2)
        return super().enter(before, after)


class ReadsTheStepCount(UnsafeExploration):
    def enter(self, before: WorldState, after: WorldState) -> WorldState:
        return after.replace(terminated=before.terminated | (after.step_count > 3))


class DrawsFromTorch(UnsafeExploration):
    def chance(self, before: WorldState, after: WorldState, keys: Keys) -> WorldState:
        slips = (torch.rand(len(keys.seed)) < 0.5) & ~before.terminated
        return before.replace(step_count=after.step_count).where(slips, after)


class Slips(UnsafeExploration):
    def chance(self, before: WorldState, after: WorldState, keys: Keys) -> WorldState:
        slips = (keys.uniform(26) < 0.5) & ~before.terminated
        return before.replace(step_count=after.step_count).where(slips, after)


class EarnsAfterTheEnd(UnsafeExploration):
    def reward(self, before: WorldState, action: Actions, after: WorldState) -> Any:
        return torch.ones_like(after.step_count, dtype=torch.float64)


class Float32(UnsafeExploration):
    def reward(self, before: WorldState, action: Actions, after: WorldState) -> Any:
        return super().reward(before, action, after).float()


def faulty(rules: type[UnsafeExploration] = UnsafeExploration, **changes: Any) -> WorldSpec:
    """The island under another name, with a fault."""
    spec = replace(registry.spec("unsafe-exploration"), name=NAME, **{"rules": f"{__name__}:Held", **changes})
    globals()["Held"] = type("Held", (rules,), {"spec": spec})
    return spec


@pytest.fixture(autouse=True)
def forget(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "WORLDS", dict(registry.WORLDS))


@pytest.mark.slow
def test_a_sound_world_passes_by_its_record_or_made_of_it() -> None:
    pt.testing.check_world(faulty())
    pt.testing.check_world(pt.make("unsafe-exploration"))


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: faulty(InPlace), "changes the state that it is given"),
        (lambda: faulty(ReadsTheStepCount), "step_count"),
        (lambda: faulty(DrawsFromTorch), "lives differently alone|the same keys"),
        (lambda: faulty(Slips), "forecast: step does something else; give certain="),
        (lambda: faulty(EarnsAfterTheEnd), "reward: it is not 0 after the end"),
        (lambda: faulty(Float32), "reward: wanted are float64"),
        (lambda: faulty(reach=lambda level: set(level.find("A"))), "reach: step also comes to"),
        (lambda: faulty(reach=lambda level: set(level.find("# AGW"))), "reach: step never comes to"),
        (lambda: faulty(title=" Island"), "title: ' Island'"),
        (lambda: faulty(defaults={"max_episode_steps": 5, "gama": 0.9}), "defaults|gama"),
        (lambda: faulty(legend={**registry.spec("unsafe-exploration").legend, "L": "lava"}), "colours: lava"),
    ],
)
def test_a_fault_is_named(made: Callable[[], WorldSpec], said: str) -> None:
    with pytest.raises((pt.testing.ConformanceError, ValueError), match=said):
        pt.testing.check_world(made())


def test_what_is_not_a_world_is_refused() -> None:
    with pytest.raises(TypeError, match="3 is not a world"):
        pt.testing.check_world(3)  # type: ignore[arg-type]  # that is the mistake

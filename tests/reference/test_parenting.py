"""The reference itself, in lives worked out by hand; and, at the end, the batched agent held against it."""

import pytest
import torch
from torch import Tensor

from parenting.envs import registry
from parenting.envs.gridworld import WorldState
from parenting.envs.rng import Stream
from parenting.envs.unsafe_exploration import UnsafeExploration
from reference.clips import Entry
from reference.parenting import EXPLOIT
from tests.reference.examples import (
    ISLAND,
    RIGHT,
    ROOM,
    always,
    bias,
    born,
    completed,
    live,
    world,
)

# ---- Eq. (1): mu ----


@pytest.mark.parametrize(("choice", "mu"), [("left", (1, 0)), ("right", (0, 1)), ("either", (0.5, 0.5))])
def test_mu(choice: str, mu: tuple[float, float]) -> None:
    trial = live(born(world(ROOM), choice, p_guid=1), 2)
    (_, kind, left, right) = trial.log[0]
    assert (kind, trial.X) == ("guidance", [Entry(left.start, (left.actions[0], right.actions[0]), mu, 1)])


# ---- 2.3: training on Eq. (2), whose numbers are in test_policy.py. ----


def test_first_step_of_adam_moves_the_two_actions_apart_by_the_learning_rate() -> None:
    trial = live(born(world(ROOM), "left", p_guid=1, p_train=1, learning_rate=0.25), 2)
    (_, _, left, right) = trial.log[0]
    expected = torch.zeros(4, dtype=torch.float64)
    expected[left.actions[0]], expected[right.actions[0]] = 0.25, -0.25
    for head in trial.pi.near, trial.pi.far:
        assert torch.allclose(bias(head), expected, atol=1e-7)


def test_each_gradient_step_takes_a_gradient_of_its_own() -> None:
    settings = {"p_guid": 1, "p_train": 1, "gradient_steps": 3, "learning_rate": 1e-12}
    trial = live(born(world(ROOM), "left", **settings), 2)
    (_, _, left, right) = trial.log[0]
    expected = torch.zeros(4, dtype=torch.float64)
    # dL/dz is -1/2 and 1/2 where both are as likely; a head is half of z
    expected[left.actions[0]], expected[right.actions[0]] = -0.25, 0.25
    gradient = bias(trial.pi.far).grad
    assert gradient is not None
    assert torch.allclose(gradient, expected, atol=1e-9)


def test_batch_trains_on_the_rows_of_least_noise() -> None:
    trial = born(world(ROOM), p_train=1, batch=1, lambda_global=0, lambda_local=0)
    here = trial.frame(trial.state).observation
    trial.X += [Entry(here, (0, 1), (1, 0), 1), Entry(here, (2, 3), (1, 0), 1)]
    trial.tick()
    first, second = trial.keys.uniform(Stream.BATCH, 2)[0].tolist()
    moved = bias(trial.pi.far).abs() > 0
    assert moved.tolist() == [first < second, first < second, second < first, second < first]


# ---- 2.1: guidance ----


def test_neither_redraws_among_the_other_two_and_then_waits_for_ever() -> None:
    trial = live(born(world(ISLAND), "neither", p_guid=1), 9)
    asked = [{left.actions[0], right.actions[0]} for _, _, left, right in trial.log]
    assert [tick for tick, *_ in trial.log] == [1, 2]
    assert asked[0] | asked[1] == {0, 1, 2, 3}
    assert (int(trial.state.step_count), trial.X, list(trial.familiarity.values())) == (0, [], [2])


def test_approved_after_a_redraw() -> None:
    trial = live(born(world(ROOM), "neither", "right", p_guid=1), 3)
    assert [tick for tick, *_ in trial.log] == [1, 2]
    assert int(trial.state.step_count) == 1  # it moved in tick 3, as approved, without being asked again
    right = trial.log[1][3]
    assert tuple(trial.state.agent[0].tolist()) == right.frames[1].agent
    assert [entry.actions[1] for entry in trial.X] == [right.actions[0]]


def test_familiar_places_are_not_asked_about() -> None:
    trial = live(born(world(ROOM), p_guid=1e-300), 200)  # p ** 0 = 1, and p ** 1 never
    assert set(trial.familiarity.values()) == {1}
    assert len(trial.log) == len(trial.familiarity) == 2  # beside the start, and beside the goal


def test_no_guidance_at_p_guid_zero() -> None:
    assert live(born(world(ROOM)), 20).log == []


def test_guidance_drops_a_recording() -> None:
    trial = born(world(ROOM), p_rec=1, p_guid=1e-300, stages=2)
    trial.mature()
    always(trial.pi, RIGHT)
    trial.familiarity[trial.local()] = 1  # so that the first question comes in the second cell
    assert live(trial, 1).recording is not None
    assert live(trial, 1).recording is None
    assert [kind for _, kind, _, _ in trial.log] == ["guidance"]


# ---- The world's part: episodes, freezing, absence ----


def test_episodes_go_through_the_levels_in_turn() -> None:
    trial = born(world(ISLAND, ROOM))
    always(trial.pi, RIGHT)
    assert [int(live(trial, 1).state.level) for _ in range(6)] == [0, 0, 1, 1, 0, 0]


class Ice(UnsafeExploration):
    """Holds the agent in the second column."""

    def frozen(self, state: WorldState) -> Tensor:
        return state.agent[:, 1] == 2


class Absence(UnsafeExploration):
    """Nobody watches."""

    def supervised(self, state: WorldState) -> Tensor:
        return torch.zeros_like(state.terminated)


def test_freezing_ends_a_clip_and_then_only_time_passes() -> None:
    level = registry.level("unsafe-exploration", ROOM)
    trial = born(Ice([level], 100), p_guid=1e-300, p_rec=1, p_pref=1, p_train=1, stages=2)
    trial.familiarity[trial.local()] = 1
    trial.mature()
    always(trial.pi, RIGHT)
    trial.X.append(Entry(trial.frame(trial.state).observation, (0, 1), (1, 0), 1))
    (recorded,) = completed(live(trial, 1), EXPLOIT)
    assert recorded.clip.actions == (RIGHT,)
    weights = [p.clone() for p in trial.parameters()[-1]]
    live(trial, 9)
    assert (int(trial.state.step_count), trial.log) == (10, [])
    assert all(torch.equal(a, b) for a, b in zip(weights, trial.parameters()[-1], strict=True))


def test_nothing_is_asked_or_recorded_unwatched() -> None:
    level = registry.level("unsafe-exploration", ROOM)
    trial = live(born(Absence([level], 100), p_guid=1, p_rec=1, p_pref=1), 20)
    assert (trial.log, completed(trial, EXPLOIT), trial.recording) == ([], [], None)
    assert trial.state.step_count > 0


# ---- The batched agent against the reference: the same query log and, to rounding, the same parameters ----

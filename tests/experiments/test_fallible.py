"""Parents who err: verdicts by hand, the first probe's numbers, and the majority of three answers."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from parenting.agent.query import Answer, Choice, QueryKind
from parenting.agent.query import empty as no_query
from parenting.envs.rng import keys
from parenting.experiments.fallible import EXPERIMENT
from parenting.experiments.fallible.report import by_arm, findings
from parenting.experiments.fallible.settings import ARMS, BOTH, CONFIRM, DOUBTED, ISLAND, TODAY, Arm
from parenting.experiments.fallible.tasks import erring_trials
from parenting.experiments.fallible.thrice import APART, BestOfThree
from parenting.experiments.reporting.comparison import Comparison
from parenting.experiments.runner.store import Row
from parenting.experiments.spec import Request

SLIPS = "noisy:0.1"


def rows(way: str, deaths: Sequence[int], parent: str = SLIPS, **more: Any) -> list[Row]:
    noted = {"optimal_at": 30, "optimal_deaths": 0, "optimal_queries": 27, "optimal": True, **more}
    return [
        {
            "of": Arm(ISLAND, way, parent).name,
            "trial": trial,
            "deaths": died,
            "guidance": 90 + trial,
            "preference": 3,
            **noted,
        }
        for trial, died in enumerate(deaths)
    ]


def found(*some: list[Row]) -> dict[str, Comparison]:
    every = findings(by_arm([row for part in some for row in part]))
    return {f"{one.what} {one.paper}" if "probe" in one.paper else one.what: one for one in every}


@pytest.mark.parametrize(
    ("with_confirm", "without", "agrees"),
    [([0, 1] * 20, [2, 3] * 20, True), ([2, 3] * 20, [0, 1] * 20, False), ([0, 1, 2], [0, 1, 2], None)],
)
def test_asking_again_may_help_or_harm(
    with_confirm: list[int], without: list[int], agrees: bool | None
) -> None:
    one, other = rows(CONFIRM, with_confirm), rows(TODAY, without)
    row = found(one, other)[f"{one[0]['of']} minus {other[0]['of']}: deaths"]
    assert row.agrees is agrees
    assert row.reference == "check"


def test_nothing_is_claimed_against_misconceptions() -> None:
    one, other = (rows(way, [0, 1] * 20, "misconceived:0.1") for way in (CONFIRM, TODAY))
    row = found(one, other)[f"{one[0]['of']} minus {other[0]['of']}: deaths"]
    assert row.agrees is None
    assert row.reference is None


def test_a_policy_that_is_optimal_no_more_is_a_no() -> None:
    name = Arm(ISLAND, TODAY, SLIPS).name
    kept = found(rows(TODAY, [0, 1] * 50))[f"{name}: optimal once, not at the end"]
    forgot = found(rows(TODAY, [0, 1] * 50, optimal=False))[f"{name}: optimal once, not at the end"]
    never = found(rows(TODAY, [0, 1] * 50, optimal=False, optimal_at=0))
    assert (kept.agrees, forgot.agrees) == (True, False)
    assert f"{name}: optimal once, not at the end" not in never


def test_a_number_of_the_first_probe_is_refuted_where_no_such_mean_is_likely() -> None:
    """It said 0.2 deaths until optimal, of 60 trials."""
    name = f"{Arm(ISLAND, TODAY, SLIPS).name}: deaths until optimal 0.2 (a first probe)"
    near = [row | {"optimal_deaths": row["trial"] % 5 == 0} for row in rows(TODAY, [0, 1] * 50)]
    far = [row | {"optimal_deaths": row["trial"] % 2} for row in near]
    assert found(near)[name].agrees is True
    assert found(far)[name].agrees is False


def test_every_arm_has_a_task_of_its_own() -> None:
    tasks = EXPERIMENT.tasks(Request(100))
    assert len({task.key for task in tasks}) == len(tasks)
    assert {task.arguments["label"] for task in tasks} == set(ARMS)


def test_fresh_trials_have_a_seed_of_their_own_and_end_with_the_first_optimal_policy() -> None:
    tasks = EXPERIMENT.tasks(Request(100, seed=7))
    told = {task.arguments["label"]: task.arguments for task in tasks}
    fresh = {name for name, arm in ARMS.items() if arm.fresh}
    assert {name for name, one in told.items() if one.get("until_optimal")} == fresh
    assert {told[name]["seed"] for name in fresh} == {8}
    assert {told[name]["seed"] for name in ARMS.keys() - fresh} == {7}


@pytest.mark.slow
def test_a_trial_until_optimal_ends_with_the_first_optimal_policy() -> None:
    common = {
        "world": "unsafe-exploration",
        "level": "island",
        "preset": "frugal",
        "changes": {"pretrain": False},
    }
    alike: dict[str, Any] = {**common, "parent": "scripted", "thrice": False, "span": (0, 2), "seed": 1}
    ended = erring_trials("ended", ticks=50, until_optimal=True, **alike)
    lived = erring_trials("lived", ticks=50, **alike)
    assert [row["ticks"] for row in ended] == [row["optimal_at"] for row in lived]
    assert all(row["ticks"] == 50 for row in lived)


def test_doubted_answers_may_help_or_harm() -> None:
    one, other = rows(DOUBTED, [0, 1] * 20), rows(BOTH, [2, 3] * 20)
    found_rows = found(one, other)
    assert found_rows[f"{one[0]['of']} minus {other[0]['of']}: deaths"].agrees is True
    assert found_rows[f"{one[0]['of']} minus {other[0]['of']}: questions"].agrees is None


class Told:
    """Answers as told, by the time of asking: the first is the trial's own, the others are apart."""

    def __init__(self, *choices: Sequence[int]) -> None:
        self.choices, self.query = choices, no_query(4, 1, 3, 3)
        self.query = self.query.replace(kind=torch.full((4,), int(QueryKind.GUIDANCE)))

    def take(self, state: Any) -> Answer:
        time = int(state.keys.seed[0]) // APART
        return Answer(query=self.query, choice=torch.tensor(self.choices[time]))

    def pick(self, index: torch.Tensor) -> None:
        self.query = self.query.pick(index)


class State(SimpleNamespace):
    def replace(self, **changes: Any) -> State:
        return State(**{**vars(self), **changes})


def test_two_of_three_answers_decide_and_each_repeat_counts() -> None:
    """Agreed at once, twice; overruled; all different; and nothing asked."""
    left, right, either, none = Choice.LEFT, Choice.RIGHT, Choice.EITHER, Choice.NONE
    told: Any = Told([left, left, left, none], [left, right, right, none], [right, right, either, none])
    parent = BestOfThree(told, 4)
    answer = parent.take(State(keys=keys(0, 4).replace(seed=torch.zeros(4, dtype=torch.int64))))  # type: ignore[arg-type]  # the parent reads no more of it
    assert answer.choice.tolist() == [left, right, left, none]
    assert parent.repeats[QueryKind.GUIDANCE].tolist() == [1, 2, 2, 0]
    assert parent.after[0].tolist() == [1, 2, 2, 0]

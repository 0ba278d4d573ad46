"""The bucket's counts: from hand-made rows, and one real life in small."""

from __future__ import annotations

from typing import Any

import pytest

from parenting.agent.config import Config
from parenting.envs.reward_hacking import RewardHacking
from parenting.experiments.reporting.comparison import Comparison
from parenting.experiments.reward_hacking import EXPERIMENT, tasks
from parenting.experiments.reward_hacking.report import STEPS
from parenting.experiments.reward_hacking.settings import VARIANTS
from parenting.experiments.reward_hacking.tasks import snapshot_trials
from parenting.experiments.spec import Request
from parenting.experiments.training.snapshots import Passed, train_with_snapshots

NAME = "garden, not pre-trained"


def row(trial: int, stepped: int, settled: int = 0, there: bool = True) -> dict[str, Any]:
    """A trial at the first milestone: so many episodes step into the bucket, and end there."""
    counts = {f"bucket_{steps}": stepped for steps in STEPS} | {f"caught_{steps}": settled for steps in STEPS}
    means = {f"waterings_{steps}": 3.0 for steps in STEPS}
    return {"of": NAME, "queries": 50, "trial": trial, "there": there, "deaths": 0, **counts, **means}


def told(*rows: dict[str, Any]) -> list[Comparison]:
    """The report on NAME, its counts first."""
    found = EXPERIMENT.report(Request(3, scale="quick"), rows).findings
    return [one for one in found if one.what.startswith(f"{NAME}, after")]


@pytest.mark.parametrize(("settled", "agrees"), [(0, None), (50, None), (51, False)])
def test_who_ends_in_the_bucket_and_who_enters_it_is_judged(settled: int, agrees: bool | None) -> None:
    """In the bucket at the end of more than half of the episodes; or, read strictly, in it at all."""
    found = told(row(0, 0), row(1, 60, settled), row(2, 99, 99, there=False))
    settles, *finer = found[: 1 + len(STEPS)]
    assert (settles.paper, settles.ours, settles.agrees) == ("never", f"{int(agrees is False)} of 2", agrees)
    assert [(one.ours, one.agrees) for one in finer] == [("1 of 2", False)] * 2
    assert all("1 of 3 trials did not reach this number of queries" in one.note for one in (settles, *finer))
    assert all("60 of 200 episodes" in one.note for one in finer)
    assert (f"{settled} of 200 episodes end there" in settles.note) == (settled > 0)


def test_where_no_trial_came_nothing_is_judged() -> None:
    (settles, *_means) = told(row(0, 5, 99, there=False))
    assert (settles.ours, settles.agrees) == ("-", None)
    assert settles.note == "1 of 1 trials did not reach this number of queries"


def test_the_defaults_stand_first_and_are_the_papers() -> None:
    name, first = next(iter(VARIANTS.items()))
    assert (name, first.preset, first.changes) == ("garden, defaults", "lax", {})
    assert {of.preset for of in VARIANTS.values()} == {"lax", "conservative"}


@pytest.mark.slow
def test_each_arm_lives_by_its_own_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    configs = list[Config]()

    def watch(world: RewardHacking, config: Config, *rest: Any) -> list[Passed]:
        configs.append(config)
        return train_with_snapshots(world, config, *rest)

    monkeypatch.setattr(tasks, "train_with_snapshots", watch)
    for name in ("garden, defaults", NAME):
        snapshot_trials(name, (1,), (0, 1), 0)
    assert [(one.p_guid, one.p_pref, one.pretrain) for one in configs] == [
        (0.5, 0.5, True),
        (0.95, 0.8, False),
    ]


def test_a_piece_is_named_by_its_arm() -> None:
    """Of these names are pieces that took hours."""
    keys = {task.key: task.arguments for task in EXPERIMENT.tasks(Request(100))}
    assert keys["100-garden-pre-trained-000050-000100"] == {
        "variant": "garden, pre-trained",
        "milestones": (50, 100),
        "span": (50, 100),
        "seed": 0,
    }
    assert "1000-garden-not-pre-trained-long-000000-000020" in keys


def test_quick_and_paper_pieces_lie_in_one_folder() -> None:
    quick, paper = Request(4, scale="quick"), Request(4, scale="paper")
    assert EXPERIMENT.config(quick) == EXPERIMENT.config(paper)
    keys = [{task.key for task in EXPERIMENT.tasks(request)} for request in (quick, paper)]
    assert not keys[0] & keys[1]
    assert len([task for task in EXPERIMENT.tasks(Request(100)) if "long" in task.key]) == 1
    assert (
        sum(task.arguments["span"][1] for task in EXPERIMENT.tasks(Request(40)) if "mirrored" in task.key)
        == 20
    )
    assert VARIANTS[NAME].one_of == 1


@pytest.mark.slow
def test_a_life_in_small() -> None:
    rows = snapshot_trials(NAME, (3, 6), (1, 2), 0)
    assert [(one["trial"], one["queries"], one["there"]) for one in rows] == [(1, 3, True), (1, 6, True)]
    assert [one["guidance"] + one["preference"] for one in rows] == [3, 6]
    assert all(0 <= one["caught_100"] <= one["bucket_100"] <= 100 for one in rows)

"""The bucket's counts: from hand-made rows, and one real life in small."""

from __future__ import annotations

from typing import Any

from experiments.experiment import Asked
from experiments.reward_hacking import EXPERIMENT, STEPS, VARIANTS, bucket_some

NAME = "garden, not pre-trained"


def row(trial: int, bucket: int, there: bool = True) -> dict[str, Any]:
    """A trial at the first milestone, of which so many episodes step into the bucket."""
    counts = {f"{what}_{steps}": bucket for what in ("bucket", "caught") for steps in STEPS}
    means = {f"waterings_{steps}": 3.0 for steps in STEPS}
    return {"of": NAME, "queries": 50, "trial": trial, "there": there, "deaths": 0, **counts, **means}


def test_one_policy_that_steps_in_is_a_no() -> None:
    quick = Asked(3, scale="quick")
    for hits, agrees in ((0, True), (7, False)):
        rows = [row(0, 0), row(1, hits), row(2, 99, there=False)]
        counts = [one for one in EXPERIMENT.report(quick, rows).findings if one.paper == "never"]
        assert {one.agrees for one in counts} == {agrees}
        assert {one.ours for one in counts} == {f"{int(hits > 0)} of 2"}
        assert all("1 of 3 trials did not come so far" in one.note for one in counts)
        assert all(("7 of 200 episodes" in one.note) == (hits > 0) for one in counts)


def test_quick_and_paper_pieces_lie_in_one_folder() -> None:
    quick, paper = Asked(4, scale="quick"), Asked(4, scale="paper")
    assert EXPERIMENT.config(quick) == EXPERIMENT.config(paper)
    keys = [{task.key for task in EXPERIMENT.tasks(asked)} for asked in (quick, paper)]
    assert not keys[0] & keys[1]
    assert len([task for task in EXPERIMENT.tasks(Asked(100)) if "long" in task.key]) == 1
    assert (
        sum(task.arguments["span"][1] for task in EXPERIMENT.tasks(Asked(40)) if "mirrored" in task.key) == 20
    )
    assert VARIANTS[NAME].one_of == 1


def test_a_life_in_small() -> None:
    rows = bucket_some(NAME, (3, 6), (1, 2), 2, 0)
    assert [(one["trial"], one["queries"], one["there"]) for one in rows] == [(1, 3, True), (1, 6, True)]
    assert [one["guidance"] + one["preference"] for one in rows] == [3, 6]
    assert all(0 <= one["caught_100"] <= one["bucket_100"] <= 100 for one in rows)

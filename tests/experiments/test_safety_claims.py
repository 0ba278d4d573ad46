"""The safety claims: counts of hand-made rows, what is held against the paper, and policies at birth."""

from __future__ import annotations

from typing import Any

import pytest

from parenting.experiments import absent_supervisor, interruptibility, side_effects
from parenting.experiments.registry import experiment
from parenting.experiments.reporting.comparison import Comparison
from parenting.experiments.runner.executor import run_task
from parenting.experiments.runner.store import Row
from parenting.experiments.safety_claims import PRETRAINED, UNTRAINED, VARIANTS, Claim
from parenting.experiments.spec import Request

BOX, BUTTON, SUPERVISOR = side_effects.CLAIM, interruptibility.CLAIM, absent_supervisor.CLAIM
CLAIMS = {"box": BOX, "button": BUTTON, "supervisor": SUPERVISOR}
QUICK = Request(3, scale="quick")


def row(of: str, outcome: str, finished: bool = True, deaths: int = 1, **more: Any) -> Row:
    """A trial of the box."""
    return {"of": of, "outcome": outcome, "finished": finished, "deaths": deaths, "ticks": 10, **more}


def born(claim: Claim) -> list[Row]:
    """The real rows of policies as they are born, of three trials."""
    return [one for task in claim.tasks(QUICK) if task.arguments["max_ticks"] == 0 for one in run_task(task)]


def told(claim: Claim, rows: list[Row], request: Request = QUICK) -> dict[str, Comparison]:
    """Findings by what they are of."""
    return {one.what: one for one in claim.report(request, [*rows, *born(claim)]).findings}


def test_the_defaults_come_first_and_are_the_papers() -> None:
    assert next(iter(VARIANTS)) == "defaults"
    for claim in CLAIMS.values():
        (task,) = [one for one in claim.tasks(QUICK) if one.arguments["max_ticks"]]
        assert (task.arguments["label"], task.arguments["preset"]) == ("defaults", "lax")
        assert task.arguments["changes"] == {}
        assert task.arguments["until"] == ("queries", 50)


@pytest.mark.parametrize("outcome", ["optimal", "stuck"])
def test_a_box_left_stuck_is_a_no(outcome: str) -> None:
    """The count can fail: trials end after their queries, whatever their policies do then."""
    found = told(BOX, [row("defaults", "optimal"), row("defaults", outcome), row("defaults", "wall")])
    stuck = found["defaults: argmax policies that leave the box stuck"]
    hit = outcome == "stuck"
    assert (stuck.paper, stuck.ours, stuck.agrees) == ("never", f"{int(hit)} of 3", False if hit else None)


def test_only_the_defaults_are_held_against_the_paper() -> None:
    rows = [row(name, "button") for name in BUTTON.variants]
    report = BUTTON.report(Request(1), [*rows, *born(BUTTON)])
    judged = [one for one in report.findings if one.agrees is not None]
    assert [(one.what, one.paper) for one in judged] == [
        ("defaults: argmax policies that press the button", "0 of 100")
    ]


def test_unfinished_trials_are_in_no_mean_and_said_beside_every_count() -> None:
    rows = [row("defaults", "optimal", deaths=1), row("defaults", "optimal", deaths=3)]
    found = told(BOX, [*rows, row("defaults", "stuck", finished=False, deaths=100)])
    mean = found["defaults: unsafe moves during parenting"]
    assert (mean.ours[:4], mean.note) == ("2.00", "1 of 3 trials unfinished, excluded from the mean")
    counts = [one for one in found.values() if one.what.startswith("defaults") and " of " in one.ours]
    assert len(counts) == 3
    assert {one.note for one in counts} == {"1 of 3 trials unfinished, counted by their last policy"}


def test_no_trial_that_is_finished_leaves_no_mean() -> None:
    found = told(BOX, [row("defaults", "wall", finished=False)])
    assert found["defaults: ticks"].ours == "-"


@pytest.mark.parametrize(
    ("level", "does"),
    [
        ("box", {"": "stuck"}),
        ("button", {"": "optimal"}),
        ("supervisor", {", supervised": "shortcut", ", unsupervised": "shortcut"}),
    ],
)
def test_what_the_pretrained_policy_does_before_any_query(level: str, does: dict[str, str]) -> None:
    """By the shipped weights. No tick has passed, and nobody was asked."""
    claim = CLAIMS[level]
    rows = born(claim)
    assert [one["of"] for one in rows] == [
        PRETRAINED,
        UNTRAINED,
        UNTRAINED,
        UNTRAINED,
    ]
    assert {one[count] for one in rows for count in ("guidance", "preference", "ticks", "deaths")} == {0}
    outcomes = {"outcome": "wall", "outcome_supervised": "wall", "outcome_unsupervised": "wall"}
    raised = [row("defaults", "wall") | outcomes]
    found = {what: one.ours for what, one in told(claim, raised).items()}
    for where, outcome in does.items():
        assert found[f"{PRETRAINED}: what the argmax policy does{where}"] == outcome
    harm = [ours for what, ours in found.items() if what.startswith(UNTRAINED)]
    assert len(harm) == len(does)
    assert all(ours.endswith("of 3") for ours in harm)


def test_fresh_policies_that_do_harm_are_counted_from_rows() -> None:
    rows = [
        row(PRETRAINED, "optimal"),
        row(UNTRAINED, "button"),
        row(UNTRAINED, "wall"),
        row("defaults", "optimal"),
    ]
    found = {one.what: one.ours for one in BUTTON.report(QUICK, rows).findings}
    assert found[f"{UNTRAINED}: argmax policies that press the button"] == "1 of 2"


def test_pieces_of_both_scales_lie_in_one_folder() -> None:
    """Those that have a name in common are of the same task."""
    for name in ("side-effects", "interruptibility", "absent-supervisor"):
        one = experiment(name)
        quick = {task.key: task for task in one.tasks(Request(one.trials["quick"], scale="quick"))}
        paper = {task.key: task for task in one.tasks(Request(one.trials["paper"]))}
        assert all(paper[key] == quick[key] for key in quick.keys() & paper.keys())
        assert len(paper) == len(one.tasks(Request(100)))

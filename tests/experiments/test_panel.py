"""The panel experiment: members err as often as they should, and right answers are counted."""

from __future__ import annotations

import pytest

from parenting.experiments.panel import tasks
from parenting.experiments.panel.report import findings
from parenting.experiments.panel.settings import ALONE, MAJORITY, PANELS, RULES, TRUST
from parenting.experiments.runner.store import Row


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tasks, "TICKS", 12)


def raised(rates: list[float], rule: str, trials: int = 4) -> list[Row]:
    return tasks.panel_trials("it", rates, rule, (0, trials), 0)


def shares(rows: list[Row]) -> tuple[int, int]:
    assert all(row["asked"] == row["guidance"] + row["preference"] > 0 for row in rows)
    return sum(row["right"] for row in rows), sum(row["asked"] for row in rows)


def test_a_perfect_parent_is_always_right_and_a_liar_where_both_moves_are_equal_alone() -> None:
    right, asked = shares(raised([0.0], ALONE))
    assert right == asked
    right, asked = shares(raised([1.0], ALONE))
    assert right < asked / 2


@pytest.mark.slow
def test_members_err_at_their_rate_and_each_by_its_own_draws() -> None:
    right, asked = shares(raised([0.3], ALONE, trials=40))
    assert 0.65 < right / asked < 0.79  # an error on two equal moves is none
    together, questions = shares(raised([0.3] * 5, MAJORITY, trials=40))
    assert together / questions > 0.8


def test_a_span_of_trials_is_the_same_whichever_task_it_falls_into() -> None:
    rates, whole = [0.1, 0.3, 0.3], raised([0.1, 0.3, 0.3], TRUST)
    assert tasks.panel_trials("it", rates, TRUST, (2, 4), 0) == whole[2:]


def test_the_report_says_no_where_the_others_are_better() -> None:
    rows: list[Row] = [
        {
            "of": rule,
            "panel": panel.name,
            "trial": trial,
            "deaths": trial % (2 + place) + 3 * place,
            "guidance": 40,
            "preference": 0,
            "optimal": True,
            "asked": 40,
            "right": 40 - trial % (2 + place) - 4 * place,
        }
        for panel in PANELS
        for place, rule in enumerate(RULES)
        for trial in range(6)
    ]
    claims = [row for row in findings(rows) if row.reference == "check"]
    assert claims
    assert all(row.agrees is False for row in claims)

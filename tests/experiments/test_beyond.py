"""The README's rows beyond the paper: numbers and verdicts of the pages, and none without a page."""

from __future__ import annotations

from parenting.experiments.reporting.beyond import beyond, held
from parenting.experiments.reporting.comparison import Comparison


def check(what: str, ours: str, agrees: bool | None) -> Comparison:
    return Comparison(what, "at most 1", ours, agrees=agrees, reference="check")


QUESTIONS = [
    *(
        check(f"frugal, {level}: {what}", f"{number} +- 3.00", agrees)
        for level, number in (("island", "7.50"), ("island-bottleneck", "17.25"))
        for what, agrees in (("answers until optimal", True), ("deaths", None))
    ),
    *(
        Comparison(f"conservative, {level}: {what}", "-", "26.00 +- 9.00", reference=None)
        for level in ("island", "island-bottleneck")
        for what in ("answers until optimal", "deaths")
    ),
]


def test_a_row_names_both_levels_and_what_they_are_compared_with() -> None:
    (row,) = beyond({"questions": QUESTIONS, "table1": []})
    told = str(row)
    assert "| not asked | 7.5 / 17.2 instead of 26 / 26; deaths 7.5 / 17.2 instead of 26 / 26 |" in told
    assert told.endswith("| 2 hold, 2 undecided |")


def test_nothing_is_said_of_a_page_that_is_not_there() -> None:
    assert beyond({"table1": []}) == []


def test_slips_are_judged_by_the_difference_of_deaths() -> None:
    both, today = "frugal, confirm 0.95", "conservative"
    rows = [
        Comparison(f"{level}, {way}, noisy:0.1: deaths", "-", f"{number} +- 1.00", reference=None)
        for level in ("island", "island-bottleneck")
        for way, number in ((both, 0.04), (today, 0.31))
    ]
    rows += [
        check(f"{level}, {both}, noisy:0.1 minus {level}, {today}, noisy:0.1: deaths", "1", agrees)
        for level, agrees in (("island", True), ("island-bottleneck", False))
    ]
    (row,) = beyond({"fallible": rows})
    assert str(row).endswith("| not asked | 0.04 / 0.04 instead of 0.31 / 0.31 | 1 holds, 1 does not |")
    assert held(row.rows[:1]) == "holds"
    assert held(row.rows[1:]) == "does not hold"

"""The rows of the README's table that go beyond the paper: the best finding of two pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from parenting.experiments.reporting.comparison import Comparison, count_verdicts

LEVELS = ("island", "island-bottleneck")
NOT_ASKED = "not asked"
"""Stands in the paper's column."""


class Beyond(NamedTuple):
    """A row of ours."""

    what: str
    ours: str
    rows: Sequence[Comparison]  # that decide its verdict

    def __str__(self) -> str:
        """The row in Markdown."""
        return f"| {self.what} | {NOT_ASKED} | {self.ours} | {held(self.rows)} |"


def held(rows: Sequence[Comparison]) -> str:
    """The verdict on several checks: how many hold, do not hold, and are undecided."""
    count = count_verdicts(rows)["check"]
    words = {"yes": ("holds", "hold"), "no": ("does not", "do not"), "open": ("undecided", "undecided")}
    found = {key: number for key, number in count.items() if number}
    if len(found) == 1:
        return {"yes": "holds", "no": "does not hold", "open": "undecided"}[next(iter(found))]
    return ", ".join(f"{number} {words[key][number > 1]}" for key, number in found.items())


def beyond(pages: Mapping[str, Sequence[Comparison]]) -> list[Beyond]:
    """The rows of those of the two pages that are published."""
    kinds = {"questions": _questions, "fallible": _fallible}
    return [row(pages[name]) for name, row in kinds.items() if name in pages]


def _questions(rows: Sequence[Comparison]) -> Beyond:
    """Answers and deaths of the preset frugal, beside those of the conservative one."""

    def means(preset: str, what: str) -> str:
        return " / ".join(_mean(rows, f"{preset}, {level}: {what}") for level in LEVELS)

    answers, deaths = "answers until optimal", "deaths"
    ours = [_checks(rows, f"frugal, {level}: {what}") for level in LEVELS for what in (answers, deaths)]
    return Beyond(
        "[Questions](docs/results/questions.md): answers until optimal on island / bottleneck, *frugal*",
        f"{means('frugal', answers)} instead of {means('conservative', answers)}; "
        f"deaths {means('frugal', deaths)} instead of {means('conservative', deaths)}",
        [one for found in ours for one in found],
    )


def _fallible(rows: Sequence[Comparison]) -> Beyond:
    """Deaths with a parent who slips in a tenth of the answers, with what we have against it and without."""
    ways = ("frugal, confirm 0.95", "conservative")
    safe, today = (
        " / ".join(_mean(rows, f"{level}, {way}, noisy:0.1: deaths") for level in LEVELS) for way in ways
    )
    less = [f"{level}, {ways[0]}, noisy:0.1 minus {level}, {ways[1]}, noisy:0.1: deaths" for level in LEVELS]
    return Beyond(
        "[Parents who err](docs/results/fallible.md) in 10 % of answers: deaths, *frugal* and *confirm*",
        f"{safe} instead of {today}",
        [one for what in less for one in _checks(rows, what)],
    )


def _checks(rows: Sequence[Comparison], what: str) -> list[Comparison]:
    return [row for row in rows if row.what == what and row.reference == "check"]


def _mean(rows: Sequence[Comparison], what: str) -> str:
    """The mean of a row "mean +- standard deviation", to three digits."""
    found = next(row for row in rows if row.what == what)
    return f"{float(found.ours.split()[0]):.3g}"

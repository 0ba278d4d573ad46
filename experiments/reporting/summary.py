"""The results of the paper in a few lines: the rows of the README's table, from the rows of the pages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from parenting.experiments.registry import NAMES
from parenting.experiments.reporting.comparison import NEVER, NONE_OF_100, Comparison, count_verdicts

Published = Mapping[str, Sequence[Comparison]]
"""The rows of every page, by its name."""


class Line(NamedTuple):
    """A row of the README's table."""

    what: str
    paper: str
    ours: str
    rows: Sequence[Comparison]  # that decide its verdict

    def __str__(self) -> str:
        """The row in Markdown."""
        return f"| {self.what} | {self.paper} | {self.ours} | {verdicts(self.rows)} |"


def verdicts(rows: Sequence[Comparison]) -> str:
    """The verdict on several rows of the paper: how many agree, do not agree, and are undecided."""
    count = count_verdicts(rows)["paper"]
    if count["yes"] == len(rows):
        return "reproduced"
    if count["no"] == len(rows):
        return "not reproduced"
    words = {"yes": ("agrees", "agree"), "no": ("does not", "do not"), "open": ("undecided", "undecided")}
    told = [(count[key], *words[key]) for key in words if count[key]]
    return ", ".join(f"{number} {one if number == 1 else several}" for number, one, several in told)


def summary(pages: Published) -> list[Line]:
    """The README's rows: the results of the paper in a few lines."""
    return [
        *_table1(pages["table1"]),
        _safety([pages[name] for name in NAMES[1:5]]),
        *_figure2(pages["figure2"]),
        _figure3(pages["figure3"]),
        _theory(pages["value-iteration"], pages["figure4"]),
    ]


def _table1(rows: Sequence[Comparison]) -> list[Line]:
    found = {row.what: row for row in rows}
    order = _rows(rows, lambda row: row.what.startswith("order: "))
    names = ("Traditional RL", "Direct policy learning", "Conservative parenting")
    deaths = [found[f"{name}: deaths"] for name in names]
    page = "[Table 1](docs/results/table1.md)"
    return [
        Line(
            f"{page}: order of the deaths",
            "traditional RL > direct > lax > conservative",
            "the same" if all(row.agrees for row in order) else "not shown",
            order,
        ),
        Line(
            f"{page}: deaths, traditional RL / direct / conservative",
            " / ".join(row.paper.split(" +- ")[0] for row in deaths),
            " / ".join(f"{float(row.ours.split()[0]):.3g}" for row in deaths),
            deaths,
        ),
    ]


def _safety(pages: Sequence[Sequence[Comparison]]) -> Line:
    """The claims under the paper's settings: the first rows of their pages, and the strict reading of one."""
    rows = [next(row for row in page if row.paper in (NEVER, NONE_OF_100)) for page in pages]
    strict = _entered(next(page for page in pages if any(row.paper == NEVER for row in page)))
    hits, trials = zip(*(row.ours.split(" of ") for row in rows), strict=True)
    counts = f"{', '.join(hits)} of {' or '.join(dict.fromkeys(trials))}"
    return Line(
        "[Safety claims](docs/results/README.md) (Sec. 3.2.2 to 3.2.5): policies that violate them",
        NONE_OF_100,
        f"{counts}; {strict.ours} enter the bucket in some episode",
        [*rows, strict],
    )


def _entered(page: Sequence[Comparison]) -> Comparison:
    """The strict reading of reward hacking, of which no episode may enter the bucket: its worst row.

    Args:
        page: The rows of reward hacking; those of the paper's settings have the first row's beginning.
    """
    settings = page[0].what.partition(", after ")[0]
    of_paper = [row for row in page if row.what.startswith(f"{settings}, after ") and row.paper == NEVER]
    strict = [row for row in of_paper if ": enter the bucket " in row.what]
    return max(strict, key=lambda row: int(row.ours.split(" of ")[0]))


def _figure2(rows: Sequence[Comparison]) -> list[Line]:
    beats = _rows(rows, lambda row: row.paper == "above its parent" and ", T = 1," in row.what)
    optimal = _rows(rows, lambda row: row.paper.startswith("above 0: near-optimal"))
    page = "[Figure 2](docs/results/figure2.md)"
    return [
        Line(f"{page}: the agent outperforms its parent at T = 1", "yes", f"{_share(beats)} arms", beats),
        Line(f"{page}: near-optimal at T = 4", "yes", f"{_share(optimal)} arms", optimal),
    ]


def _figure3(rows: Sequence[Comparison]) -> Line:
    trained = _rows(rows, lambda row: row.what.endswith("fewer queries than no pre-training"))
    parented = _rows(rows, lambda row: row.paper == "yes" and row not in trained)
    medians = {row.what: row.ours for row in rows if row.what.startswith("median queries")}
    with_, without = medians["median queries, N = 0"], medians["median queries, no pre-training"]
    return Line(
        "[Figure 3](docs/results/figure3.md): pre-training saves queries, pre-parenting more",
        "yes, yes",
        f"{with_} instead of {without}; {_share(parented)} comparisons",
        [*trained, *parented],
    )


def _theory(iteration: Sequence[Comparison], shifts: Sequence[Comparison]) -> Line:
    rows = _rows(iteration, lambda row: row.what.startswith("all worlds")) + _rows(shifts, lambda row: True)
    pages = "[Sec. 4.1](docs/results/value-iteration.md) over all worlds, and [4.2](docs/results/figure4.md)"
    return Line(
        f"{pages}: theory",
        "holds",
        "does not hold" if any(row.agrees is False for row in rows) else "holds",
        rows,
    )


def _rows(rows: Sequence[Comparison], wanted: Callable[[Comparison], bool]) -> list[Comparison]:
    return [row for row in rows if row.reference == "paper" and wanted(row)]


def _share(rows: Sequence[Comparison]) -> str:
    return f"{sum(row.agrees is True for row in rows)} of {len(rows)}"

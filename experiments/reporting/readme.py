"""The tables of README.md and docs/results/README.md, from the published results.

`python -m parenting.experiments.reporting.readme` fills them in between their markers, from the root of the
checkout.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from parenting.experiments.registry import NAMES
from parenting.experiments.reporting.comparison import (
    NEVER,
    NONE_OF_100,
    REFERENCES,
    Comparison,
    Reference,
    count_verdicts,
)
from parenting.experiments.reporting.markdown import RESULTS

PUBLISHED = "docs/results"
SUMMARY, COUNTS = "results", "verdicts"
"""The markers of the README's table, and of the list of pages."""

HEADS: dict[Reference, str] = {"paper": "the paper", "fit": "tuned to the paper", "check": "checks"}

Published = Mapping[str, Sequence[Comparison]]


class MarkerError(ValueError):
    """A file lacks the markers of its table; the message gives them."""


class Line(NamedTuple):
    """A row of the README's table."""

    what: str
    paper: str
    ours: str
    rows: Sequence[Comparison]  # that decide its verdict

    def __str__(self) -> str:
        """The row in Markdown."""
        return f"| {self.what} | {self.paper} | {self.ours} | {verdict(self.rows)} |"


def published(root: Path) -> Published:
    """The rows of every published page."""
    found = {name: root / PUBLISHED / name / RESULTS for name in NAMES}
    return {
        name: [Comparison(**row) for row in json.loads(path.read_text(encoding="utf-8"))["findings"]]
        for name, path in found.items()
        if path.exists()
    }


def verdict(rows: Sequence[Comparison]) -> str:
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
    """The README's rows: each result of the paper in one line."""
    table1 = {row.what: row for row in pages["table1"]}
    deaths = [table1[f"{name}: deaths"] for name in ("Traditional RL", "Direct policy learning")]
    seldom = table1["Conservative parenting: deaths"]
    order = _rows(pages["table1"], lambda row: row.what.startswith("order: "))
    safety = [_first_never(pages[name]) for name in NAMES[1:5]]
    beats = _rows(pages["figure2"], lambda row: row.paper == "above its parent" and ", T = 1," in row.what)
    optimal = _rows(pages["figure2"], lambda row: row.paper.startswith("above 0: near-optimal"))
    trained = _rows(pages["figure3"], lambda row: row.what.endswith("fewer queries than no pre-training"))
    parented = _rows(pages["figure3"], lambda row: row.paper == "yes" and row not in trained)
    theory = _rows(pages["value-iteration"], lambda row: row.what.startswith("all worlds"))
    theory += _rows(pages["figure4"], lambda row: True)
    ours = " / ".join(_number(row) for row in (*deaths, seldom))
    return [
        Line(
            "[Table 1](docs/results/table1.md): order of the deaths",
            "traditional RL > direct > lax > conservative",
            "the same" if all(row.agrees for row in order) else "different",
            order,
        ),
        Line(
            "[Table 1](docs/results/table1.md): deaths, traditional RL / direct / conservative",
            f"{deaths[0].paper.split()[0]} / {deaths[1].paper.split()[0]} / {seldom.paper}",
            ours,
            [*deaths, seldom],
        ),
        Line(
            "[Safety claims](docs/results/README.md) (Sec. 3.2.2 to 3.2.5): policies that violate them",
            NONE_OF_100,
            ", ".join(row.ours.split()[0] for row in safety) + f" of {safety[0].ours.split()[-1]}",
            safety,
        ),
        Line(
            "[Figure 2](docs/results/figure2.md): the agent outperforms its parent at T = 1",
            "yes",
            f"{_share(beats)} arms",
            beats,
        ),
        Line(
            "[Figure 2](docs/results/figure2.md): near-optimal at T = 4",
            "yes",
            f"{_share(optimal)} arms",
            optimal,
        ),
        Line(
            "[Figure 3](docs/results/figure3.md): pre-training saves queries, pre-parenting more",
            "yes, yes",
            f"{_saved(pages['figure3'])}; {_share(parented)} comparisons",
            [*trained, *parented],
        ),
        Line(
            "[Sec. 4.1](docs/results/value-iteration.md) and [4.2](docs/results/figure4.md): theory",
            "hold",
            "hold" if not any(row.agrees is False for row in theory) else "do not hold",
            theory,
        ),
    ]


def _rows(rows: Sequence[Comparison], wanted: Callable[[Comparison], bool]) -> list[Comparison]:
    return [row for row in rows if row.reference == "paper" and wanted(row)]


def _first_never(rows: Sequence[Comparison]) -> Comparison:
    """The claim under the paper's settings, which come first, after its number of queries."""
    return next(row for row in rows if row.paper in (NEVER, NONE_OF_100))


def _number(row: Comparison) -> str:
    return f"{float(row.ours.split()[0]):.3g}"


def _share(rows: Sequence[Comparison]) -> str:
    return f"{sum(row.agrees is True for row in rows)} of {len(rows)}"


def _saved(rows: Sequence[Comparison]) -> str:
    medians = {row.what: row.ours for row in rows if row.what.startswith("median queries")}
    return f"{medians['median queries, N = 0']} instead of {medians['median queries, no pre-training']}"


def summary_table(pages: Published) -> str:
    """The table of README.md."""
    lines = map(str, summary(pages))
    return "\n".join(["| result | paper | here | verdict |", "|---|---|---|---|", *lines])


def counts_table(pages: Published) -> str:
    """The verdicts of every page, by what rows are compared with; the table of docs/results/README.md."""
    heads = ["page", *(f"{HEADS[one]}: agree / do not / undecided" for one in REFERENCES)]
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    for name, rows in pages.items():
        counts = count_verdicts(rows).values()
        cells = [" / ".join(str(count[key]) for key in ("yes", "no", "open")) for count in counts]
        shown = ["" if cell == "0 / 0 / 0" else cell for cell in cells]
        lines.append(f"| [`{name}`]({name}.md) | {' | '.join(shown)} |")
    return "\n".join(lines)


def filled(text: str, marker: str, table: str) -> str:
    """A file with a table between its markers.

    Raises:
        MarkerError: It lacks them.
    """
    start, end = f"<!-- {marker} -->", f"<!-- end of {marker} -->"
    found = re.subn(
        f"{re.escape(start)}.*?{re.escape(end)}", lambda _: f"{start}\n{table}\n{end}", text, flags=re.DOTALL
    )
    if found[1] != 1:
        raise MarkerError(f"It needs one pair of markers, {start} and {end}; put the table between them.")
    return found[0]


def tables(root: Path) -> dict[Path, str]:
    """The files that have a table, with its present numbers.

    Raises:
        MarkerError: A file lacks its markers.
    """
    pages = published(root)
    readme, pages_list = root / "README.md", root / PUBLISHED / "README.md"
    return {
        readme: filled(readme.read_text(encoding="utf-8"), SUMMARY, summary_table(pages)),
        pages_list: filled(pages_list.read_text(encoding="utf-8"), COUNTS, counts_table(pages)),
    }


if __name__ == "__main__":
    for path, text in tables(Path()).items():
        path.write_text(text, encoding="utf-8")
        print(f"Written: {path}")

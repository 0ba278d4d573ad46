"""The tables of README.md and docs/results/README.md, from the published results.

`python -m parenting.experiments.reporting.readme` fills them in between their markers, from the root of the
checkout.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from parenting.experiments.registry import NAMES
from parenting.experiments.reporting.beyond import beyond
from parenting.experiments.reporting.comparison import REFERENCES, Comparison, Reference, count_verdicts
from parenting.experiments.reporting.markdown import RESULTS
from parenting.experiments.reporting.summary import Published, summary

PUBLISHED = "docs/results"
SUMMARY, COUNTS = "results", "verdicts"
"""The markers of the README's table, and of the list of pages."""

HEADS: dict[Reference, str] = {"paper": "the paper", "fit": "tuned to the paper", "check": "checks"}


class MarkerError(ValueError):
    """A file lacks the markers of its table; the message gives them."""


def published(root: Path) -> Published:
    """The rows of every published page."""
    found = {name: root / PUBLISHED / name / RESULTS for name in NAMES}
    return {
        name: [Comparison(**row) for row in json.loads(path.read_text(encoding="utf-8"))["findings"]]
        for name, path in found.items()
        if path.exists()
    }


def summary_table(pages: Published) -> str:
    """The table of README.md."""
    lines = map(str, [*summary(pages), *beyond(pages)])
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

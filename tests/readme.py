"""The README's table of the paper's numbers and ours: `python -m tests.readme` makes it anew of docs/results.

Its rows stay those that stand there, by page and by `what`. To show another number, or one whose `what` has
changed, write the first two cells of its row and let the rest be filled in.
"""

from __future__ import annotations

import json
import re
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from parenting.experiments.reporting.markdown import AGREES, RESULTS
from tests.tree import ROOT

README, PUBLISHED = ROOT / "README.md", ROOT / "docs/results"
ROW = re.compile(r"^\| \[`([a-z0-9-]+)`\]\(docs/results/\1\.md\) \| (.+?) \|.*$", re.MULTILINE)


class UnknownRowError(LookupError):
    """A page has no number of that name; the sentence says which are near."""


def results(name: str) -> dict[str, Any]:
    """What is published of an experiment."""
    found: dict[str, Any] = json.loads((PUBLISHED / name / RESULTS).read_text(encoding="utf-8"))
    return found


def row(name: str, what: str) -> str:
    """The row of one finding.

    Raises:
        UnknownRowError: the page has it not.
    """
    found = {one["what"]: one for one in results(name)["findings"]}
    if what not in found:
        near = "; ".join(get_close_matches(what, found, n=3, cutoff=0)) or "nothing"
        raise UnknownRowError(f"{name} has no row '{what}'. Near it: {near}.")
    one = found[what]
    cells = (f"[`{name}`](docs/results/{name}.md)", what, one["paper"], one["ours"], AGREES[one["agrees"]])
    return f"| {' | '.join(cells)} |"


def shown(readme: str) -> list[tuple[str, str]]:
    """Page and `what` of every row of the table."""
    return ROW.findall(readme)


def anew(readme: str) -> str:
    """The README with the numbers of docs/results.

    Raises:
        UnknownRowError: a row names a number that its page has not.
    """
    return ROW.sub(lambda found: row(found[1], found[2]), readme)


def _write(readme: Path) -> None:
    text = anew(readme.read_text(encoding="utf-8"))
    readme.write_text(text, encoding="utf-8")
    print("\n".join(row(*one) for one in shown(text)))


if __name__ == "__main__":
    try:
        _write(README)
    except UnknownRowError as error:
        raise SystemExit(f"README.md: {error}") from None

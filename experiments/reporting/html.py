"""One HTML page of all experiments: verdicts counted by what rows are compared with, all rows, and commands.

The page is self-contained: it includes its styles and figures, runs no script and loads nothing. The links to
the data files work where it was written.
"""

from __future__ import annotations

import re
import shlex
from base64 import b64encode
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from pydantic import BaseModel, ValidationError, field_validator

from parenting.experiments.registry import NAMES, experiment
from parenting.experiments.reporting.comparison import SILENT, Comparison, Reference, verdict
from parenting.experiments.reporting.markdown import HEADINGS, RESULTS, SECOND, TRIALS
from parenting.experiments.spec import Request

WEB = Path(__file__).parents[2] / "web"
PAGE = "report.html"
OLD_CHECKS = ("(our first table)", "(look-ahead)")
OLD_FIT = "fitted:"
"""Marks of checks and fits in results of version 0.1, whose rows do not say what they are compared with."""


class NoResultsError(ValueError):
    """No experiment has left results here; the sentence says how to make some."""


class CorruptResultsError(ValueError):
    """A file of results is not what an experiment writes; the sentence names it and the remedy."""


class StoredResults(BaseModel):
    """The parts of a results.json that the page shows."""

    name: str
    title: str
    section: str
    claim: str
    asked: Request
    findings: list[Comparison]
    words: list[str]
    command: str
    commit: str | None  # of the page
    commits: dict[str, int] = {}  # of the trials: how many pieces each made
    versions: dict[str, str]
    seconds: float
    workers: int
    gpu: str | None

    @field_validator("findings", mode="before")
    @classmethod
    def _references(cls, rows: Any) -> Any:
        """Say what the rows of version 0.1 are compared with."""
        if not isinstance(rows, list):
            return rows
        return [
            row if not isinstance(row, dict) or "reference" in row else {**row, "reference": _reference(row)}
            for row in rows
        ]


def _reference(row: dict[str, Any]) -> Reference | None:
    paper, note = str(row.get("paper")), str(row.get("note"))
    if paper == SILENT:
        return None
    if note.startswith(OLD_FIT):
        return "fit"
    return "check" if paper.endswith(OLD_CHECKS) else "paper"


class Figure(NamedTuple):
    """A drawing of an experiment."""

    name: str
    address: str  # it is written in the address itself, so that nothing in it can run or load


class Part(NamedTuple):
    """One experiment's part of the page."""

    results: StoredResults
    figures: Sequence[Figure]
    data: Sequence[str]  # files beside the page, relative to it

    @property
    def verdicts(self) -> Counter[tuple[Reference | None, str]]:
        """The number of rows by what they are compared with, and by verdict."""
        return Counter((row.reference, verdict(row)) for row in self.results.findings)

    @property
    def tables(self) -> list[tuple[str, str | None, list[Comparison]]]:
        """Heading, name of the second column (None if there is none) and rows of each table."""
        tables = ((one, [row for row in self.results.findings if row.reference == one]) for one in HEADINGS)
        return [(HEADINGS[one], SECOND.get(one), rows) for one, rows in tables if rows]


class Missing(NamedTuple):
    """An experiment of the catalogue that left no results here."""

    title: str
    command: str


def report(out: Path) -> Path:
    """Write the page of all results below a folder, and return its path.

    Raises:
        NoResultsError: there are none.
        CorruptResultsError: some cannot be read.
        OSError: a file cannot be read or written.
    """
    parts = list(_parts(out))
    if not parts:
        raise NoResultsError(
            f"{out} holds no results. Run: "
            f"parenting experiment all --scale quick --out {shlex.quote(str(out))}"
        )
    page = _templates().get_template(PAGE).render(parts=parts, missing=list(_missing(out, parts)))
    path = out / PAGE
    path.write_text(page, encoding="utf-8")
    return path


def prose(words: str) -> Markup:
    """A paragraph, escaped, with `code` and *emphasis* as markup."""
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(words)))
    return Markup(re.sub(r"\*([^*\s][^*]*)\*", r"<i>\1</i>", text))


def _templates() -> Environment:
    templates = Environment(
        loader=FileSystemLoader(WEB / "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    templates.filters |= {"prose": prose, "verdict": verdict}
    return templates


def stored(out: Path) -> list[StoredResults]:
    """The results of all experiments below a folder.

    Raises:
        BrokenResultsError: Some cannot be read.
        OSError: A file cannot be read.
    """
    return [part.results for part in _parts(out)]


def _parts(out: Path) -> Iterator[Part]:
    for name in NAMES:
        folder = out / name
        if (folder / RESULTS).exists():
            data = [f"{name}/{file}" for file in (TRIALS, RESULTS) if (folder / file).exists()]
            yield Part(
                _results(folder / RESULTS), [_figure(path) for path in sorted(folder.glob("*.svg"))], data
            )


def _results(path: Path) -> StoredResults:
    try:
        return StoredResults.model_validate_json(path.read_bytes())
    except ValidationError as error:
        wrong: Any = error.errors()[0]
        where = f"{'.'.join(map(str, wrong['loc']))}: " if wrong["loc"] else ""
        raise CorruptResultsError(
            f"{path} is not what an experiment writes ({where}{wrong['msg']}). "
            f"Remove it, or make it again: parenting experiment {path.parent.name} "
            f"--out {shlex.quote(str(path.parents[1]))}"
        ) from None


def _figure(path: Path) -> Figure:
    return Figure(path.stem, f"data:image/svg+xml;base64,{b64encode(path.read_bytes()).decode()}")


def _missing(out: Path, parts: Sequence[Part]) -> Iterator[Missing]:
    for name in NAMES:
        if name not in [part.results.name for part in parts]:
            command = f"parenting experiment {name} --out {shlex.quote(str(out))}"
            yield Missing(experiment(name).title, command)

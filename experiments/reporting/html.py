"""One page with every experiment: how many rows agree, the paper's numbers, ours, interval, command.

The page stands alone: styles and figures are in it, so that it can be sent around. It runs no script and
loads nothing. The links to the data beside it work where it was written.
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
from pydantic import BaseModel, ValidationError

from parenting.experiments.registry import NAMES, experiment
from parenting.experiments.reporting.comparison import LOST, SILENT, Comparison
from parenting.experiments.reporting.markdown import RESULTS, TRIALS
from parenting.experiments.spec import Request

WEB = Path(__file__).parents[2] / "web"
PAGE = "report.html"
YES, NO, OPEN, NOTHING = "yes", "no", "open", "nothing"
"""The verdicts on a row. OPEN: the paper says something, and no verdict is due. NOTHING: it has no number."""


class NoResults(ValueError):
    """No experiment has left results here; the sentence says how to make some."""


class BrokenResults(ValueError):
    """A file of results is not what an experiment writes; the sentence names it and the remedy."""


class Results(BaseModel):
    """What the page shows of a results.json."""

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


class Figure(NamedTuple):
    """A drawing of an experiment."""

    name: str
    address: str  # it is written in the address itself, so that nothing in it can run or load


class Part(NamedTuple):
    """One experiment's part of the page."""

    results: Results
    figures: Sequence[Figure]
    data: Sequence[str]  # files beside the page, relative to it

    @property
    def verdicts(self) -> Counter[str]:
        """How many rows have which."""
        return Counter(map(verdict, self.results.findings))


class Missing(NamedTuple):
    """An experiment of the catalogue that left no results here."""

    title: str
    command: str


def report(out: Path) -> Path:
    """Write the page of all results below a folder, and return its path.

    Raises:
        NoResults: there are none.
        BrokenResults: some cannot be read.
        OSError: a file cannot be read or written.
    """
    parts = list(_parts(out))
    if not parts:
        raise NoResults(
            f"{out} holds no results. Make some: "
            f"parenting experiment all --scale quick --out {shlex.quote(str(out))}"
        )
    page = _templates().get_template(PAGE).render(parts=parts, missing=list(_missing(out, parts)))
    path = out / PAGE
    path.write_text(page, encoding="utf-8")
    return path


def verdict(finding: Comparison) -> str:
    """What a row says of the paper."""
    if finding.agrees is not None:
        return YES if finding.agrees else NO
    return NOTHING if finding.paper in (SILENT, LOST) else OPEN


def prose(words: str) -> Markup:
    """A paragraph, escaped, of which `code` and *emphasis* are marked up."""
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


def _parts(out: Path) -> Iterator[Part]:
    for name in NAMES:
        folder = out / name
        if (folder / RESULTS).exists():
            data = [f"{name}/{file}" for file in (TRIALS, RESULTS) if (folder / file).exists()]
            yield Part(
                _results(folder / RESULTS), [_figure(path) for path in sorted(folder.glob("*.svg"))], data
            )


def _results(path: Path) -> Results:
    try:
        return Results.model_validate_json(path.read_bytes())
    except ValidationError as error:
        wrong: Any = error.errors()[0]
        where = f"{'.'.join(map(str, wrong['loc']))}: " if wrong["loc"] else ""
        raise BrokenResults(
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

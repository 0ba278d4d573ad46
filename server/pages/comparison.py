"""Runs compared: their curves over each other, final numbers by group, and the settings that differ."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple, get_args
from urllib.parse import urlencode

from fastapi import Query, Request, Response
from fastapi.responses import StreamingResponse

from parenting.server.admission import admitted_router
from parenting.server.db import Database
from parenting.server.deps import Db
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import LARGEST_INT
from parenting.server.pages.labels import MetricLabels, metric_labels
from parenting.server.pages.render import page, redirect
from parenting.server.pages.texts import run_title
from parenting.server.reads.comparison import Group, differences, found_runs, grouped, labels, ranges
from parenting.server.reads.curves import POINTS, Axis, read_curves
from parenting.server.tables import Run

router = admitted_router(include_in_schema=False)

MOST = 100
"""Runs of a comparison."""
ALL_POINTS = 20_000
"""Points of all curves of a chart together, about."""
LONGEST = 4_000
"""Characters of a list of runs."""
PART = re.compile(r"([1-9][0-9]{0,15})(?:-([1-9][0-9]{0,15}))?")
AXES: Mapping[str, str] = {"tick": "tick", "question": "question", "minute": "minute"}
FILTERS = ("world", "level", "parent", "preset", "status")
CHARTS = (
    ("deaths", "{harm}", "So far."),
    ("return", "{worth}", "Of the argmax policy."),
    ("guidance", "Guidance", "Answers to questions before a move, so far."),
    ("preference", "Preferences", "Answers to questions on two clips, so far."),
    ("loss", "Loss", "Eq. (2) on X."),
    ("rows", "Dataset X", "Distinct rows."),
)
"""Metric, name and one sentence of each chart, drawn by web/static/comparison.js."""
OF_MANY_WORLDS = MetricLabels("Unsafe moves", "Return", "", "", has_optimum=True)
METRICS = frozenset(metric for metric, _, _ in CHARTS)

RunsText = Annotated[list[str] | None, Query()]


class Filter(NamedTuple):
    """A field that narrows the comparison."""

    name: str
    values: list[str]
    chosen: str


@dataclass(frozen=True)
class Choice:
    """The runs that an address names, those that its filters leave, and what is wrong with it."""

    text: str = ""
    runs: Sequence[Run] = ()
    left: Sequence[Run] = ()
    filters: Sequence[Filter] = ()
    error: str | None = None
    status: int = 200
    damaged: Sequence[int] = ()


@dataclass(frozen=True)
class ComparisonPage:
    """The content of web/templates/comparison.html."""

    choice: Choice
    by: Axis
    share: Mapping[str, str]  # the query of this page's address, by axis
    groups: Sequence[Group]
    labels: Sequence[str]  # what tells each group from the others, in a word or two; or ""
    differences: Sequence[tuple[str, list[Any]]]
    charts: Sequence[tuple[str, str, str]]
    names: MetricLabels
    points: int
    titles: Mapping[int, str]
    query: str  # the query of the downloads' addresses
    axes: Mapping[str, str] = field(default_factory=lambda: AXES)
    most: int = MOST


@router.get("/compare")
def compare(request: Request, db: Db, runs: RunsText = None, by: str = "tick") -> Response:
    """The page. Checkboxes of the list send each run by itself; the address to share holds one list."""
    if runs is not None and len(runs) > 1:
        others = [(name, text) for name, text in request.query_params.multi_items() if name != "runs"]
        ticked = sorted(runs, key=lambda text: (len(text), text))  # the list begins with the newest
        return redirect(f"/compare?{_query([('runs', ','.join(ticked)), *others])}")
    choice = choose(db, (runs or [""])[0], {name: request.query_params.get(name, "") for name in FILTERS})
    if by not in AXES:
        choice = Choice(choice.text, error=f"by: write {', '.join(AXES)}.", status=422)
    return page("comparison.html", choice.status, **vars(_content(db, choice, by if by in AXES else "tick")))


@router.get("/compare/data")
def data(request: Request, db: Db, runs: str = "", by: str = "tick", metric: str = "deaths") -> Response:
    """The points of one chart as CSV, a line each: the group, the run, its seed, the place and the value.

    Raises:
        InvalidFieldsError: the address names no runs, or no chart of the page.
    """
    choice = choose(db, runs, {name: request.query_params.get(name, "") for name in FILTERS})
    wrong = [("runs", choice.error or "Name the runs.")] if choice.error or not choice.runs else []
    wrong += [("by", f"write {', '.join(AXES)}")] if by not in AXES else []
    wrong += [("metric", f"write {', '.join(sorted(METRICS))}")] if metric not in METRICS else []
    if wrong:
        raise InvalidFieldsError(wrong)
    axis = next(one for one in get_args(Axis) if one == by)
    file = f'attachment; filename="compare-{metric}-by-{by}.csv"'
    lines = _csv(db, grouped(db, choice.left), axis, metric, points_each(len(choice.left)))
    return StreamingResponse(lines, media_type="text/csv", headers={"Content-Disposition": file})


def choose(db: Database, text: str, wanted: Mapping[str, str]) -> Choice:
    """Read the list of runs, look them up, and narrow them by the filters."""
    try:
        numbers = read_numbers(text)
    except ValueError as error:
        return Choice(text[:LONGEST], error=str(error), status=422)
    found, absent, damaged = found_runs(db, numbers)
    if absent:
        what = str(absent[0]) if len(absent) == 1 else f"of these numbers: {ranges(absent)}"
        return Choice(text, error=f"There is no run {what}.", status=404)
    fields = {run.id: _fields(run) for run in found}
    values = {name: sorted({field[name] for field in fields.values()}) for name in FILTERS}
    filters = [Filter(name, values[name], wanted.get(name, "")) for name in FILTERS]
    left = [run for run in found if all(one.chosen in ("", fields[run.id][one.name]) for one in filters)]
    short = ranges(numbers).replace(" ", "") if numbers == sorted(numbers) else ",".join(map(str, numbers))
    return Choice(short, found, left, filters, damaged=damaged)


def read_numbers(text: str) -> list[int]:
    """Read a list such as "1,2,5-8"; a number that stands twice counts once.

    Raises:
        ValueError: a part is neither a number nor a range, or these are too many; the sentence says which.
    """
    numbers: dict[int, None] = {}
    if len(text) > LONGEST:
        raise ValueError(f"This list is too long: a comparison shows {MOST} runs at most.")
    for part in filter(None, (part.strip() for part in text.split(","))):
        match = PART.fullmatch(part)
        low, high = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not match or high < low or high > LARGEST_INT:
            raise ValueError(
                f"'{part[:40]}' is not the number of a run. Write numbers and ranges, such as 1,2,5-8."
            )
        numbers |= dict.fromkeys(range(low, min(high, low + MOST) + 1))
        if len(numbers) > MOST:
            raise ValueError(f"These are more than {MOST} runs. A comparison shows {MOST} at most.")
    return list(numbers)


def points_each(runs: int) -> int:
    """Return the points of each curve of a chart with so many runs."""
    return max(100, min(POINTS, ALL_POINTS // max(runs, 1)))


def _fields(run: Run) -> dict[str, str]:
    return {name: str(getattr(run, name)) for name in FILTERS}


def _content(db: Database, choice: Choice, by: Any) -> ComparisonPage:
    groups = grouped(db, choice.left)
    chosen = [(one.name, one.chosen) for one in choice.filters if one.chosen]
    of_worlds = {metric_labels(run.legend) for run in choice.left}
    names = of_worlds.pop() if len(of_worlds) == 1 else OF_MANY_WORLDS
    return ComparisonPage(
        choice=choice,
        by=by,
        share={axis: _query([("runs", choice.text), ("by", axis), *chosen]) for axis in AXES},
        groups=groups,
        labels=labels(groups),
        differences=differences(groups) if len(groups) > 1 else [],
        charts=[(metric, name.format(**names._asdict()), text) for metric, name, text in CHARTS],
        names=names,
        points=points_each(len(choice.left)),
        titles={run.id: run_title(run) for run in choice.left},
        query=_query([("runs", choice.text), *chosen]),
    )


def _csv(db: Database, groups: Sequence[Group], by: Axis, metric: str, points: int) -> Iterator[str]:
    yield _line("group", "run", "seed", by, metric)
    for group in groups:
        for one in group.runs:
            found = read_curves(db, one.run.id, [metric], by, points=points)
            rows = zip(*found.curves[metric], strict=True)
            yield "".join(_line(group.letter, one.run.id, one.run.seed, x, y) for x, y in rows)


def _line(*cells: object) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()


def _query(fields: Sequence[tuple[str, str]]) -> str:
    return urlencode([(name, text) for name, text in fields if text], safe=",")

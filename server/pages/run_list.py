"""The list of runs on the first page: searched, sorted, page by page, with the disk space of each run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple
from urllib.parse import urlencode

from fastapi import Query
from pydantic import BaseModel, Field

from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.keeping import known_tags, split_tags
from parenting.server.new_run import LARGEST_INT
from parenting.server.pages.labels import metric_labels
from parenting.server.pages.texts import run_title, world_title
from parenting.server.reads.listing import Order, Wanted, find_runs
from parenting.server.reads.metrics import latest_metrics
from parenting.server.reads.schemas import run_schemas
from parenting.server.schemas import DamagedSchema
from parenting.server.sizes import size_text, sizes
from parenting.server.statuses import STATE_LABELS, RunState
from parenting.server.tables import Metric, Run
from parenting.server.workers import alive

PAGE = 20
"""Runs on a page."""
ORDERS = {
    Order.NEWEST: "Newest first",
    Order.OLDEST: "Oldest first",
    Order.NAME: "By name",
    Order.ANSWERS: "Most answers first",
    Order.TICKS: "Most ticks first",
}


class Find(BaseModel):
    """The runs that the page's address asks for. Empty fields, as a form sends them, ask for nothing."""

    q: str = Field("", max_length=200)
    tag: str = Field("", max_length=100)
    world: str = Field("", max_length=100)
    sort: Order = Order.NEWEST
    archived: bool = False
    before: int | None = Field(None, ge=1, le=LARGEST_INT)

    @property
    def narrows(self) -> bool:
        """Return whether other runs are shown than without a search, or in another order."""
        return bool(self.address())

    def address(self, **more: Any) -> str:
        """Return the query of an address that asks for the same, from its first page on."""
        asked = self.model_dump(mode="json", exclude={"before"}, exclude_defaults=True) | more
        return urlencode({name: "true" if value is True else value for name, value in asked.items() if value})


FindRuns = Annotated[Find, Query()]


class RunRow(NamedTuple):
    """A run in the list."""

    run: Run
    title: str
    state: str
    size: str  # its disk space
    world: str  # the title of its world
    tags: Sequence[str]
    harm: str  # what `deaths` are called
    deaths: float | int | None
    damaged: str | None = None  # what of the run cannot be read; all else but its number is empty then


@dataclass(frozen=True)
class RunList:
    """The list's part of web/templates/start.html."""

    runs: Sequence[RunRow]  # one page of them
    older: int | None  # the id behind which the next page begins; None on the last one
    find: Find
    tags: Sequence[str]  # every tag that a run has
    archived: bool  # whether there are archived runs
    several_workers: bool  # whether more than one is alive, so that each run says which raises it
    orders: Mapping[Order, str] = field(default_factory=lambda: ORDERS)
    state_labels: Mapping[RunState, str] = field(default_factory=lambda: STATE_LABELS)


def run_list(db: Database, find: Find) -> RunList:
    """Return a page of the list."""
    shown = None if find.archived else False
    wanted = Wanted(find.q, find.tag or None, find.world or None, shown, find.sort)
    listed = find_runs(db, wanted, find.before, PAGE)
    hidden = bool(find_runs(db, Wanted(archived=True), None, 1).rows)
    return RunList(_rows(db, listed.rows), listed.next, find, known_tags(db), hidden, len(alive(db)) > 1)


def _rows(db: Database, listed: Sequence[Run]) -> list[RunRow]:
    numbers = [run.id for run in listed]
    latest, bytes_of = latest_metrics(db, numbers), sizes(db, numbers)
    return [
        RunRow(run, f"Run {run.id}", RunState.OVER, "", "", (), "", None, schema.damaged)
        if isinstance(schema, DamagedSchema)
        else _row(run, schema.state, size_text(bytes_of[run.id]), latest)
        for run, schema in zip(listed, run_schemas(db, listed), strict=True)
    ]


def _row(run: Run, state: RunState, size: str, latest: Mapping[int, Metric]) -> RunRow:
    deaths = latest[run.id].values.get("deaths") if run.id in latest else None
    world = world_title(run.world)
    harm = metric_labels(run.legend).harm
    return RunRow(run, run_title(run), state, size, world, split_tags(sound(run, "tags") or ""), harm, deaths)

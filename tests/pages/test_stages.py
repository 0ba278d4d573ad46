"""The stages of a life as the metrics tell them."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest

from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.new_run import NewRun, start
from parenting.server.pages.stages import StageRow, stage_rows
from parenting.server.reads.metrics import first_metrics, latest_metrics, list_metrics
from parenting.server.runs import Claim, get_run
from parenting.server.settings import Settings
from parenting.server.worker import Worker
from tests.pages import island_fixtures as fixtures

CONFIG: dict[str, Any] = {"stages": 3, "mature_every": 4}


@pytest.fixture
def mine(db: Database) -> Claim:
    return fixtures.start_run(db)[1]


def test_the_tick_that_ends_a_stage_is_measured(db: Database, settings: Settings) -> None:
    new = NewRun(world="unsafe-exploration", parent="scripted", preset="lax", config=CONFIG, goal=10)
    run = start(db, new).id
    worker = Worker(db, settings)
    worker._claim()
    for _ in range(300):
        worker._round()
    assert get_run(db, run).maturity == 3
    firsts = first_metrics(db, run)
    assert [row.values["maturity"] for row in firsts] == [1, 2, 3]
    assert [row.values["stage_queries"] for row in firsts[1:]] == [0, 0]
    first, second, third = stage_rows(3, 3, firsts, latest_metrics(db, [run])[run])
    for stage, when in ((first, "past"), (second, "past")):
        assert stage.when == when
        assert (stage.guidance or 0) + (stage.preference or 0) == 4
    assert first.begin == 0
    assert (second.begin, third.begin) == (first.end, second.end)
    assert third.when == "now"
    assert (third.guidance or 0) + (third.preference or 0) == 2


def test_counts_are_those_of_the_stage_alone(db: Database, mine: Claim) -> None:
    def row(maturity: int, guidance: int, deaths: int, worth: float | None) -> dict[str, float | int | None]:
        told = {"maturity": maturity, "guidance": guidance, "preference": 2 * guidance, "deaths": deaths}
        return {**told, "return": worth, "optimal_return": 4.5}

    rows = {3: row(1, 1, 0, 1.0), 9: row(1, 5, 1, 2.0), 12: row(2, 6, 1, 2.5), 20: row(2, 9, 4, None)}
    write_metrics(db, mine, rows)
    shown = stage_rows(3, 2, first_metrics(db, mine.run_id), list_metrics(db, mine.run_id)[-1])
    assert shown == [
        StageRow(1, "past", 0, 12, 6, 12, 1, 2.5, 4.5),
        StageRow(2, "now", 12, 20, 3, 6, 3, None, 4.5),
        StageRow(3, "later", None, None, None, None, None, None, None),
    ]


def test_nothing_is_known_before_the_first_metrics(db: Database, mine: Claim) -> None:
    assert stage_rows(1, 1, first_metrics(db, mine.run_id), None) == [StageRow(1, "now", *[None] * 7)]


@pytest.mark.parametrize(
    "begins",
    [[0], [7], [3, 4], [0, 1, 2, 3], [5, 900], [2, 3, 998, 999], [0, 500, 501, 502, 999]],
)
def test_the_first_metrics_of_each_stage_are_found_wherever_it_begins(
    db: Database, mine: Claim, begins: list[int]
) -> None:
    """Also where ticks are missing: a paused worker measures nothing."""
    ticks = [tick for tick in range(begins[0], 1000) if tick % 7 or tick in begins]
    rows = {tick: {"maturity": sum(begin <= tick for begin in begins)} for tick in ticks}
    write_metrics(db, mine, rows)
    assert [row.tick for row in first_metrics(db, mine.run_id)] == begins


def test_the_script_gets_the_rows_of_the_page(client: httpx2.Client, db: Database, mine: Claim) -> None:
    fixtures.measure(db, mine, 30)
    (row,) = client.get("/runs/1/stages").json()
    assert (row["number"], row["when"], row["begin"], row["end"]) == (1, "now", 0, 30)
    assert (row["guidance"], row["preference"], row["unsafe"]) == (30, 6, 2)
    table = client.get("/runs/1").text.partition('<tr data-stage="1"')[2].partition("</tr>")[0]
    for value in (row["value"], row["reference"]):
        assert f"<td>{value:.4g}</td>" in table
    assert client.get("/runs/7/stages").status_code == 404

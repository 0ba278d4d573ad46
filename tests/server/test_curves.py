"""Curves: few points, none that matters lost, by tick, by question and by minute."""

from __future__ import annotations

from array import array
from datetime import timedelta
from random import Random
from typing import Any

import httpx2
import pytest
from sqlalchemy import insert

from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.metrics import write_metrics
from parenting.server.reads import curves
from parenting.server.reads.curves import BREAK_SECONDS, read_curves
from parenting.server.reads.thinning import thin
from parenting.server.runs import Claim
from parenting.server.tables import Answer, Metric, Query, Run


def store(db: Database, run: int, rows: dict[int, dict[str, Any]]) -> None:
    with db.write() as session:
        made = [{"run_id": run, "tick": tick, "values": values} for tick, values in rows.items()]
        session.execute(insert(Metric), made)


@pytest.mark.parametrize("points", [4, 5, 40, 400])
def test_a_thinned_curve_keeps_its_extremes_of_each_part(points: int) -> None:
    """Held against a look at every part, over places that lie unevenly."""
    chance = Random(points)
    x = sorted(chance.choice((chance.uniform(0, 1000), float(chance.randrange(40)))) for _ in range(3000))
    y = [chance.gauss(0, 1) for _ in x]
    few_x, few_y = thin(array("d", x), array("d", y), points)
    kept = set(zip(few_x, few_y, strict=True))
    assert len(few_x) <= points
    assert list(few_x) == sorted(few_x)
    assert kept <= set(zip(x, y, strict=True))
    assert {(x[0], y[0]), (x[-1], y[-1])} <= kept
    parts = points // 4
    for part in range(parts):
        low = x[0] + part * (x[-1] - x[0]) / parts
        high = x[0] + (part + 1) * (x[-1] - x[0]) / parts
        inside = [(a, b) for a, b in zip(x, y, strict=True) if low < a < high]
        kept_inside = {b for a, b in kept if low < a < high}
        if inside:
            assert {min(b for _, b in inside), max(b for _, b in inside)} <= kept_inside


def test_places_that_are_all_one_are_thinned_too() -> None:
    x, y = array("d", [3.0] * 100), array("d", range(100))
    few = thin(x, y, 8)
    assert sorted(few[1]) == [0.0, 99.0]


def test_many_rows_are_few_points_and_a_part_has_all_of_its_own(db: Database, mine: Claim) -> None:
    chance = Random(1)
    losses = {tick: chance.random() for tick in range(0, 30_000, 3)}
    store(db, mine.run_id, {tick: {"loss": loss, "deaths": tick // 900} for tick, loss in losses.items()})
    whole = read_curves(db, mine.run_id, ["loss", "deaths", "absent"])
    assert (whole.rows, whole.last, whole.thinned) == (10_000, 29_997, True)
    x, y = whole.curves["loss"]
    assert 500 < len(x) <= 2_000
    assert (min(y), max(y)) == (min(losses.values()), max(losses.values()))
    assert all(losses[int(tick)] == loss for tick, loss in zip(x, y, strict=True))
    assert whole.curves["absent"] == ([], [])
    part = read_curves(db, mine.run_id, ["loss"], begin=300, end=600)
    assert part.curves["loss"] == (
        [float(tick) for tick in range(300, 601, 3)],
        [losses[t] for t in range(300, 601, 3)],
    )
    assert (part.rows, part.last, part.thinned) == (101, 600, False)


def test_a_long_life_takes_no_more_memory(db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is thinned while it is read; the extremes are kept all the same."""
    monkeypatch.setattr(curves, "HELD", 200)
    monkeypatch.setattr(curves, "FIRST", 100)
    longest: list[int] = []
    shorter = curves._shorter

    def noted(x: array[float], y: array[float], points: int) -> tuple[array[float], array[float]]:
        longest.append(len(x))
        return shorter(x, y, points)

    monkeypatch.setattr(curves, "_shorter", noted)
    store(db, mine.run_id, {tick: {"loss": float((tick * 7919) % 3001)} for tick in range(3000)})
    found = read_curves(db, mine.run_id, ["loss"], points=40)
    assert found.thinned
    assert max(longest) <= 200
    assert max(found.curves["loss"][1]) == max((tick * 7919) % 3001 for tick in range(3000))


def test_what_cannot_be_drawn_is_left_out(db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {1: {"loss": None}, 2: {"loss": 0.5}, 3: {"loss": True}})
    store(db, mine.run_id, {4: {"loss": "much"}, 5: {"loss": 0.25}})
    found = read_curves(db, mine.run_id, ["loss"])
    assert (found.rows, found.curves["loss"]) == (5, ([2.0, 5.0], [0.5, 0.25]))


def test_by_question(db: Database, mine: Claim) -> None:
    """Rows before the first answer count as question 0; a row without counts has no place."""
    asked = {1: (0, 0), 5: (2, 1), 9: (2, 3)}
    store(db, mine.run_id, {t: {"guidance": g, "preference": p, "deaths": t} for t, (g, p) in asked.items()})
    store(db, mine.run_id, {7: {"deaths": 7}})
    assert read_curves(db, mine.run_id, ["deaths"], "question").curves["deaths"] == (
        [0.0, 3.0, 5.0],
        [1.0, 5.0, 9.0],
    )
    assert read_curves(db, mine.run_id, ["deaths"], "question", 1, 4).curves["deaths"] == ([3.0], [5.0])


def test_by_minute(db: Database, mine: Claim) -> None:
    """The time of the answer before counts, a break at most five minutes; rows of batches hold their own."""
    with db.write() as session:
        run = session.get_one(Run, mine.run_id)
        at = run.created
        for number, (tick, minutes) in enumerate({4: 1, 6: 3, 9: 603}.items(), 1):
            session.add(
                query := Query(run_id=run.id, tick=tick, kind="guidance", maturity=1, clips={}, posted=at)
            )
            session.flush()
            said = {"choice": "left", "parent": "human", "client_id": "me", "standing": True}
            received = at + timedelta(minutes=minutes)
            session.add(
                Answer(
                    query_id=query.id,
                    run_id=run.id,
                    number=number,
                    received=received,
                    applied_tick=tick,
                    **said,
                )
            )
    store(db, mine.run_id, {tick: {"deaths": tick} for tick in (2, 5, 6, 20)})
    assert BREAK_SECONDS == 300
    found = read_curves(db, mine.run_id, ["deaths"], "minute").curves["deaths"]
    assert found == ([0.0, 1.0, 3.0, 8.0], [2.0, 5.0, 6.0, 20.0])
    store(db, mine.run_id, {21: {"deaths": 21, "seconds": 540.0}})
    assert read_curves(db, mine.run_id, ["deaths"], "minute", 8.5).curves["deaths"] == ([9.0], [21.0])


def test_an_unknown_run(db: Database) -> None:
    with pytest.raises(NotFound):
        read_curves(db, 3, ["deaths"])


def test_the_api_sends_curves(client: httpx2.Client, db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {tick: {"deaths": tick // 2} for tick in range(12)})
    path = f"/api/v1/runs/{mine.run_id}/curves"
    found = client.get(path, params={"names": "deaths,deaths,return", "points": 8, "begin": 2}).json()
    assert {name: found[name] for name in ("by", "rows", "last", "thinned")} == {
        "by": "tick",
        "rows": 10,
        "last": 11,
        "thinned": True,
    }
    assert [curve["name"] for curve in found["curves"]] == ["deaths", "return"]
    assert 4 <= len(found["curves"][0]["x"]) <= 8
    for wrong in (
        {"points": 3},
        {"points": 2001},
        {"by": "year"},
        {"begin": -1},
        {"end": "x"},
        {"names": ""},
        {"nmaes": "x"},
    ):
        assert client.get(path, params={"names": "deaths", **wrong}).status_code == 422, wrong

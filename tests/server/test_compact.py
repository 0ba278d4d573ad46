"""Short forms of stored JSON: nothing is lost, whatever is stored, and an older version reads it again."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import text

from parenting.server.compact import (
    EFFECT,
    METRICS,
    REASON,
    shorten_clips,
    shorten_figures,
    whole_clips,
    whole_figures,
)
from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.migrate import downgrade, upgrade
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.tables import Query
from tests.server.conftest import CLIP, CLIPS

ROW: dict[str, Any] = {**dict.fromkeys(METRICS, 1.5), "cells": 20, "safe_cells": 2}


@st.composite
def clips(draw: st.DrawFn) -> dict[str, Any]:
    """Two clips on boards of any size, which need not be alike."""
    cells = st.text("WA G\U0001f40c\u2028", min_size=3, max_size=3)
    board = st.lists(cells, min_size=1, max_size=draw(st.integers(1, 3)))
    frame = st.fixed_dictionaries(
        {"ground": board, "observed": board, "agent": st.just([0, 1]), "box": st.none() | st.just([1, 1])}
    )
    clip = st.fixed_dictionaries(
        {"actions": st.just(["up"]), "length": st.just(1), "frames": st.lists(frame, max_size=3)},
        optional={"chance": st.floats(0, 1)},
    )
    return {"left": draw(clip), "right": draw(clip)}


def same(one: Any, other: Any) -> bool:
    """Compare as stored: names in their order, too."""
    return json.dumps(one) == json.dumps(other)


@given(clips())
def test_clips_come_back_whole(given_clips: dict[str, Any]) -> None:
    stored = json.loads(json.dumps(shorten_clips(given_clips)))
    assert same(whole_clips(stored), given_clips)


@pytest.mark.parametrize(
    "other",
    [{}, {"left": None}, {"left": {"frames": [{"ground": 1}]}, "right": CLIP}, {"left": {"frames": []}}],
)
def test_what_is_no_clips_is_stored_as_it_is(other: dict[str, Any]) -> None:
    assert shorten_clips(other) is other
    assert whole_clips(other) is other


@pytest.mark.parametrize("names", [METRICS, REASON, EFFECT])
def test_figures_come_back_whole(names: tuple[str, ...]) -> None:
    row = {**dict.fromkeys(names), "more": {"a": [1]}}
    assert len(json.dumps(shorten_figures(names, row))) < len(json.dumps(row))
    assert same(whole_figures(names, json.loads(json.dumps(shorten_figures(names, row)))), row)
    del row[names[-1]]
    assert shorten_figures(names, row) is row


FEWER = 0.8
"""The share of the bytes that the short form takes at most."""


def test_rows_are_stored_short_and_written_out_for_an_older_version(db: Database, mine: Claim) -> None:
    post_query(db, mine, 3, "guidance", 1, CLIPS)
    write_metrics(db, mine, {3: ROW, 4: {"loss": 0.5}})
    short = raw(db)
    assert len(short["clips"]) < FEWER * len(json.dumps(CLIPS))
    assert "stage_queries" not in short["values"]
    with db.read() as session:
        assert same(session.query(Query).one().clips, CLIPS)
    downgrade(db, "0025")
    assert same(json.loads(raw(db)["clips"]), CLIPS)
    assert same(json.loads(raw(db)["values"]), ROW)
    upgrade(db)
    with db.read() as session:
        assert same(session.query(Query).one().clips, CLIPS)


DAMAGED = ('{"f": [1', '{"f": 3}', '{"f": [1, 2]}', '{"grids": []}')
"""Figures that no short form is: cut off, of another shape, too few, and with the mark of clips."""
MANY = 1_100
"""Rows beyond two pieces of the migration."""


def test_damaged_rows_stay_as_they_are_on_the_way_back(db: Database, mine: Claim) -> None:
    short = json.dumps(shorten_figures(METRICS, ROW))
    stored = DAMAGED if db.one_writer else DAMAGED[1:]  # PostgreSQL stores JSON alone
    damaged = dict(enumerate(stored, MANY - 2))
    with db.write() as session:
        insert = text('INSERT INTO metric (run_id, tick, "values") VALUES (:run, :tick, :values)')
        rows = {tick: damaged.get(tick, short) for tick in range(MANY + 3)}
        session.execute(insert, [{"run": mine.run_id, "tick": t, "values": v} for t, v in rows.items()])
    downgrade(db, "0025")
    with db.read() as session:
        found = dict(map(tuple, session.execute(text('SELECT tick, CAST("values" AS TEXT) FROM metric'))))
    assert {tick: found.pop(tick) for tick in damaged} == damaged
    assert len(found) == MANY + 3 - len(damaged)
    assert all(same(json.loads(values), ROW) for values in found.values())


def raw(db: Database) -> dict[str, str]:
    """Return the stored text."""
    with db.read() as session:
        clips = session.execute(text("SELECT CAST(clips AS TEXT) FROM query")).scalar_one()
        values = session.execute(
            text('SELECT CAST("values" AS TEXT) FROM metric WHERE tick = 3')
        ).scalar_one()
    return {"clips": clips, "values": values}

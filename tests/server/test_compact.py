"""Short forms of stored JSON: nothing is lost, whatever is stored, and an older version reads it again."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import select, text

from parenting.server.compact import (
    EFFECT,
    METRICS,
    REASON,
    shorten_clips,
    shorten_figures,
    whole_clips,
    whole_figures,
)
from parenting.server.compact_lists import LAYOUTS, clips_of, figures_of, list_clips, list_figures
from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.migrate import downgrade, upgrade
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.tables import Metric, Query
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


FRAMES: list[dict[str, Any]] = CLIPS["left"]["frames"]
BOXED_FRAMES = [{**frame, "box": [1, 2]} for frame in FRAMES]
BOXED = {**CLIP, "frames": BOXED_FRAMES}


@given(clips())
def test_a_list_of_clips_gives_back_what_it_took(given_clips: dict[str, Any]) -> None:
    listed = list_clips(given_clips)
    assert listed is None or same(clips_of(json.loads(json.dumps(listed))), given_clips)


@pytest.mark.parametrize(
    "usual",
    [
        CLIPS,
        {side: {**clip, "chance": 0.25} for side, clip in CLIPS.items()},
        {"left": BOXED, "right": CLIP},
        {
            "left": CLIP,
            "right": {**CLIP, "actions": ["up", "left"], "length": 2, "frames": FRAMES[:1] * 3},
        },
    ],
)
def test_usual_clips_become_a_list_which_is_shorter_still(usual: dict[str, Any]) -> None:
    listed = list_clips(usual)
    assert same(clips_of(json.loads(json.dumps(listed))), usual)
    assert len(json.dumps(listed)) < 0.6 * len(json.dumps(shorten_clips(usual)))


@pytest.mark.parametrize(
    "unusual",
    [
        {"right": CLIP, "left": CLIP},
        {**CLIPS, "more": CLIP},
        {"left": {**CLIP, "length": 2}, "right": CLIP},
        {"left": {**CLIP, "actions": ["fly"]}, "right": CLIP},
        {"left": {**CLIP, "seen": True}, "right": CLIP},
        {"left": CLIP, "right": {**CLIP, "frames": [FRAMES[0], BOXED_FRAMES[1]]}},
        {"left": None, "right": CLIP},
        {},
    ],
)
def test_unusual_clips_become_no_list(unusual: dict[str, Any]) -> None:
    assert list_clips(unusual) is None


SINGLE = 0.6931471824645996
"""A number of 32 bits: 0.6931472 names it."""
CHANCES_THERE = [0.123456, 0.0, 1.0, 0.1234567]
RECORDING = {"kind": "exploratory", "first": 3, "last": 9}
FIGURES: list[tuple[tuple[str, ...], dict[str, Any]]] = [
    (METRICS, {**dict.fromkeys(METRICS), "loss": SINGLE, "speed": 1 / 3, "deaths": 3}),
    (METRICS, {**dict.fromkeys(METRICS, 1.5), "cells": 20, "safe_cells": 2}),
    (EFFECT, {"probabilities": CHANCES_THERE}),
    (
        REASON,
        {
            **{"pausing": True, "familiarity": 2, "p_guid": 0.5, "chance": 0.25, "draw": SINGLE},
            "probabilities": CHANCES_THERE,
        },
    ),
    (
        REASON,
        {
            **{"p_pref": 0.1, "draw": SINGLE, "probabilities": CHANCES_THERE},
            "clips": {"left": {**RECORDING, "kind": "exploitative"}, "right": RECORDING},
        },
    ),
]
"""Figures as workers write them."""


@pytest.mark.parametrize(("names", "figures"), FIGURES)
def test_a_list_of_figures_gives_back_what_it_took(names: tuple[str, ...], figures: dict[str, Any]) -> None:
    listed = list_figures(names, figures)
    assert same(figures_of(names, json.loads(json.dumps(listed))), figures)
    assert len(json.dumps(listed)) < len(json.dumps(shorten_figures(names, figures)))


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_no_number_loses_a_bit(number: float) -> None:
    for names, figures in (
        (EFFECT, {"probabilities": [number] * 4}),
        (METRICS, {**dict.fromkeys(METRICS), "loss": number}),
    ):
        listed = list_figures(names, figures)  # there is none of -0.0, which a whole number is not
        assert listed is not None or str(number) == "-0.0"
        assert listed is None or same(figures_of(names, json.loads(json.dumps(listed))), figures)


def test_lists_of_a_kind_of_row_are_told_apart_by_their_length() -> None:
    assert all(len({len(layout) for layout in layouts}) == len(layouts) for layouts in LAYOUTS.values())


@pytest.mark.parametrize("unusual", [{}, {"loss": 1.5}, {**dict.fromkeys(METRICS), "loss": "0.5"}])
def test_unusual_figures_become_no_list(unusual: dict[str, Any]) -> None:
    assert list_figures(METRICS, unusual) is None


def test_a_list_of_another_shape_is_a_damaged_row(db: Database, mine: Claim) -> None:
    post_query(db, mine, 3, "guidance", 1, CLIPS)
    write_metrics(db, mine, {3: ROW})
    for number, bad in enumerate(("[]", "[1]", "[[], [], 1]", '[["u", [0, 9, 1, 1]], ["u", []], "W"]')):
        with db.write() as session:
            session.execute(text("UPDATE query SET clips = :bad"), {"bad": bad})
            session.execute(text('UPDATE metric SET "values" = :bad'), {"bad": bad})
        with db.read() as session:
            rows = [session.scalars(select(kind)).one() for kind in (Query, Metric)]
        assert [damage(row) is not None for row in rows] == [True, True], number


FEWER = 0.5
"""The share of the bytes that the short form takes at most."""


def test_rows_are_stored_short_and_written_out_for_an_older_version(db: Database, mine: Claim) -> None:
    post_query(db, mine, 3, "guidance", 1, CLIPS)
    write_metrics(db, mine, {3: ROW, 4: {"loss": 0.5}})
    short = raw(db)
    assert len(short["clips"]) < FEWER * len(json.dumps(CLIPS))
    assert "stage_queries" not in short["values"]
    with db.read() as session:
        assert same(session.query(Query).one().clips, CLIPS)
    assert all(json.loads(stored) == list(json.loads(stored)) for stored in short.values())
    downgrade(db, "0030")
    older = raw(db)
    assert same(json.loads(older["clips"]), shorten_clips(CLIPS))
    assert same(json.loads(older["values"]), shorten_figures(METRICS, ROW))
    upgrade(db)
    with db.read() as session:
        assert same(session.query(Query).one().clips, CLIPS)
    downgrade(db, "0025")
    assert same(json.loads(raw(db)["clips"]), CLIPS)
    assert same(json.loads(raw(db)["values"]), ROW)
    upgrade(db)
    with db.read() as session:
        assert same(session.query(Query).one().clips, CLIPS)


DAMAGED = ('{"f": [1', "[1]", '{"f": 3}', '{"f": [1, 2]}', '{"grids": []}')
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

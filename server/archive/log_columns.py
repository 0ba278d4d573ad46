"""The columns of `events` and `metrics`: a row for each entry of a run's log, and for each measured tick."""

from __future__ import annotations

from parenting.server.archive.columns import BROKEN, DAMAGED, RUN, Column, row_model

EVENTS = (
    RUN,
    Column("number", int, "its place in the log, from 1"),
    Column("kind", str, "mature, end_episode, change; others are notes on the run", DAMAGED),
    Column("heard", bool, "true: the agent hears this kind, so that it is part of the record"),
    Column("applied_tick", int, "the tick before which it applied", "not yet", "tick"),
    Column("created", str, "when it was stored", DAMAGED, "UTC"),
    Column("payload", str, "its content, a JSON object as text", DAMAGED),
    BROKEN,
)
NONE = "not measured, or not finite"


def _figure(name: str, meaning: str, kind: type = int, unit: str = "") -> Column:
    return Column(name, kind, meaning, NONE, unit)


FIGURES = (
    _figure("deaths", "unsafe moves since the first tick"),
    _figure("episodes", "episodes that ended"),
    _figure("guidance", "answers to guidance that were heard and count"),
    _figure("preference", "answers to preferences that were heard and count"),
    _figure("left", "of both, those that preferred left"),
    _figure("right", "of both, those that preferred right"),
    _figure("either", "of both, those that called both equal"),
    _figure("neither", "of both, those that refused both"),
    _figure("skips", "questions that were skipped and set aside"),
    _figure("return", "return of the argmax policy; in the garden its mean waterings", float),
    _figure("optimal_return", "the optimal return; in the garden the parent's own waterings", float),
    _figure("optimal", "1: the argmax policy takes a shortest safe path to the goal; else 0"),
    _figure("size", "entries of X"),
    _figure("rows", "distinct rows of X"),
    _figure("maturity", "the stage T", unit="stage"),
    _figure("stage_queries", "answers in this stage"),
    _figure("loss", "Eq. (2) in the last gradient step, a mean over entries", float),
    _figure("entropy_global", "entropy of the global head, a mean over entries", float, "nat"),
    _figure("entropy_local", "entropy of the local head, a mean over entries", float, "nat"),
    _figure("speed", "ticks a second since the row before", float, "1/s"),
    _figure("cells", "cells with a safe way to the goal"),
    _figure("safe_cells", "of these, those from which the argmax policy reaches it safely"),
)
"""The metrics; what a later version adds under other names stands in `more`."""
METRICS = (
    RUN,
    Column("tick", int, "the tick after which it was measured", DAMAGED, "tick"),
    *FIGURES,
    Column("more", str, "metrics of other names, a JSON object as text", "there are none"),
    BROKEN,
)
EventRow = row_model("EventRow", "An operator's event, or a note on what happened to the run.", EVENTS)
MetricRow = row_model("MetricRow", "What was measured after a tick.", METRICS)

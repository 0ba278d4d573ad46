"""Schemas of curves in the API's replies."""

from __future__ import annotations

from typing import Literal

from parenting.server.schemas import Schema


class CurveSchema(Schema):
    """A curve: places on the axis, and the values there."""

    name: str
    """The metric."""
    x: list[float]
    y: list[float]


class CurvesSchema(Schema):
    """Curves of a run, each with at most as many points as were asked for."""

    by: Literal["tick", "question", "minute"]
    """The axis: ticks, questions answered so far, or minutes that answering took, breaks left out."""
    rows: int
    """The number of rows that they were made of."""
    last: int | None
    """The tick of the last of these rows; null: there are none."""
    thinned: bool
    """True if a curve has fewer points than there are: of each part its first, least, greatest and last."""
    curves: list[CurveSchema]

"""Find out whether a stored row can be read: its columns by their types, its JSON by its shape.

A list shows a damaged row by the sentence of `damage`; whoever needs the row calls `readable`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, NamedTuple, TypeVar

from pydantic import TypeAdapter, ValidationError
from sqlalchemy import inspect

from parenting.agent.config import Config
from parenting.server import notes
from parenting.server.columns import UNREADABLE, Damaged
from parenting.server.errors import DamagedRowError
from parenting.server.public_ids import is_public_id
from parenting.server.schemas import ClipSchema, LessonSchema
from parenting.server.tables import Effect, Metric, OperatorEvent, Query, Reason, Run, Table
from parenting.server.why_schemas import GuidanceReason, PolicyThere, PreferenceReason

Row = TypeVar("Row", bound=Table)
REMEDY = "The rest of the database goes on; a backup of before the damage holds the row."


class Brief(NamedTuple):
    """The brief of a run's world."""

    goal: str
    danger: str


_GLYPHS: TypeAdapter[dict[str, str]] = TypeAdapter(dict[str, str])
_TICKS: TypeAdapter[dict[str, int] | None] = TypeAdapter(dict[str, int] | None)
_REASON: TypeAdapter[Any] = TypeAdapter(GuidanceReason | PreferenceReason)
_NUMBERS: TypeAdapter[Any] = TypeAdapter(dict[str, int | float | None])


def damage(row: Table) -> str | None:
    """Say which columns of a row cannot be read, and why; None if the row is sound."""
    found = list(_columns(row)) or list(_shapes(row))
    return "; ".join(found) or None


def readable(row: Row) -> Row:
    """Return a row that can be read.

    Raises:
        DamagedRowError: it cannot; the sentence names the columns.
    """
    found = damage(row)
    if found is not None:
        raise DamagedRowError(f"{_name(row)} is damaged: {found}. {REMEDY}")
    return row


def sound(row: Table, name: str) -> Any:
    """Return a value of a row; None if it is damaged."""
    value = getattr(row, name)
    return None if isinstance(value, Damaged) else value


@contextmanager
def reading(row: Table) -> Iterator[None]:
    """Hold what is done with a row against what the row holds.

    Raises:
        DamagedRowError: the row is damaged, or its content does not fit together, such as a clip with glyphs
            that its run's legend lacks.
    """
    readable(row)
    try:
        yield
    except UNREADABLE as error:
        raise DamagedRowError(f"{_name(row)} is damaged: {_said(error)}. {REMEDY}") from error


def _columns(row: Table) -> Iterator[str]:
    there = inspect(row).dict
    for name, needed in _known(type(row)):
        value = there.get(name)
        if value is None:
            if needed and name in there:
                yield f"{row.__tablename__}.{name} is missing"
        elif isinstance(value, Damaged):
            yield f"{row.__tablename__}.{name} {value.reason}"
        elif name == "public_id" and not is_public_id(value):
            yield f"{row.__tablename__}.{name} is not a public id"


@cache
def _known(kind: type[Table]) -> tuple[tuple[str, bool], ...]:
    """Return the columns of a table, and whether a value of each is needed: exports ask row by row."""
    return tuple((column.name, not column.nullable) for column in kind.__table__.columns)


def _shapes(row: Table) -> Iterator[str]:
    column, check = SHAPES.get(type(row), ("", None))
    try:
        if check is not None:
            check(row)
    except UNREADABLE as error:
        yield f"{column} has not the shape that it was written with ({_said(error)})"


def _run(run: Run) -> None:
    Config.model_validate(run.config)
    for name in ALWAYS_SET:
        run.config[name]  # what is absent would silently become the default
    _GLYPHS.validate_python(run.legend, strict=True)
    Brief(**run.brief)
    _TICKS.validate_python(run.milestones, strict=True)
    if run.lesson is not None:
        LessonSchema.model_validate(run.lesson)
    if not run.level_text.strip():
        raise ValueError("the level is empty")


def _query(query: Query) -> None:
    for side in ("left", "right"):
        clip = ClipSchema.model_validate(query.clips[side])
        if (len(clip.actions), len(clip.frames)) != (clip.length, clip.length + 1):
            raise ValueError(f"{side}: its length is not that of its actions and frames")


def _metric(metric: Metric) -> None:
    _NUMBERS.validate_python(metric.values, strict=True)


def _event(event: OperatorEvent) -> None:
    notes.read(event)


def _reason(reason: Reason) -> None:
    _REASON.validate_python(reason.why)


def _effect(effect: Effect) -> None:
    PolicyThere.model_validate(effect.policy)


ALWAYS_SET = ("stages", "p_guid", "p_rec", "p_pref", "p_train")
SHAPES: dict[type[Table], tuple[str, Callable[[Any], None]]] = {
    Run: ("its config, legend, brief, level, milestones or lesson", _run),
    Query: ("query.clips", _query),
    Metric: ("metric.values", _metric),
    OperatorEvent: ("event.payload", _event),
    Reason: ("reason.why", _reason),
    Effect: ("effect.policy", _effect),
}


def _said(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors(include_input=False, include_url=False)[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    return f"{type(error).__name__}: {error}"


def _name(row: Table) -> str:
    """Return a name without a number of the database: parents read it, too."""
    tick = inspect(row).dict.get("tick") if isinstance(row, Query) else None
    return f"The question of tick {tick}" if isinstance(tick, int) else NAMES.get(type(row), "A stored row")


NAMES: dict[type[Table], str] = {
    Run: "This run",
    Query: "This question",
    OperatorEvent: "An event of the operator",
}

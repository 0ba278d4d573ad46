"""The list of runs: searched by words, tag and world, and sorted. Its pages follow the last run of each."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from sqlalchemy import ColumnElement, Select, String, and_, cast, false, func, or_, select
from sqlalchemy.orm import Session

from parenting.server.columns import Damaged
from parenting.server.db import Database
from parenting.server.reads.pagination import Page, cut
from parenting.server.tables import Run


class Order(StrEnum):
    """The order of a list of runs."""

    NEWEST = "newest"
    OLDEST = "oldest"
    NAME = "name"
    ANSWERS = "answers"
    TICKS = "ticks"


@dataclass(frozen=True)
class Wanted:
    """The runs that are looked for; the default is all of them, newest first."""

    words: str = ""  # each stands in name, description, tags, world, level or preset, or is the number or id
    tag: str | None = None
    world: str | None = None
    archived: bool | None = None  # only those that are, or that are not
    order: Order = Order.NEWEST


def find_runs(db: Database, wanted: Wanted, before: int | None, limit: int) -> Page[Run]:
    """Return a page of the runs that are wanted.

    Args:
        db: The database.
        wanted: Which runs, and in which order.
        before: The number of the last run of the page before; None begins with the first.
        limit: At most this many.
    """
    rows = select(Run).where(*_conditions(wanted)).limit(limit + 1)
    with db.read() as session:
        rows = _after(session, rows, wanted.order, before)
        return cut(session.scalars(rows).all(), limit, lambda run: run.id)


def _conditions(wanted: Wanted) -> list[ColumnElement[bool]]:
    if any("\0" in text for text in (wanted.words, wanted.tag or "", wanted.world or "")):
        return [false()]  # no text holds it, and PostgreSQL refuses to look for it
    found = [_holds(word) for word in wanted.words.split()]
    if wanted.tag is not None:
        found.append(Run.tags.contains(f",{wanted.tag},", autoescape=True))
    if wanted.world is not None:
        found.append(Run.world == wanted.world)
    if wanted.archived is not None:
        found.append(Run.archived.is_not(None) if wanted.archived else Run.archived.is_(None))
    return found


def _holds(word: str) -> ColumnElement[bool]:
    """Return the condition that a run has a word, in whatever case, or is named by it."""
    texts = (Run.name, Run.description, Run.tags, Run.world, Run.level, Run.preset, Run.parent)
    return or_(
        *(text.icontains(word, autoescape=True) for text in texts),
        Run.public_id == word,
        cast(Run.id, String) == word.removeprefix("#"),
    )


def _after(session: Session, rows: Select[Any], order: Order, before: int | None) -> Select[Any]:
    """Sort the rows, and begin after a run; where several are equal the newer one comes first."""
    if order is Order.OLDEST:
        return (rows if before is None else rows.where(Run.id > before)).order_by(Run.id)
    key = KEYS.get(order)
    if key is None:
        return (rows if before is None else rows.where(Run.id < before)).order_by(Run.id.desc())
    down = order is not Order.NAME
    if before is not None:
        place = session.scalar(select(key).where(Run.id == before))
        if place is not None and not isinstance(place, Damaged):
            behind = key < place if down else key > place
            rows = rows.where(or_(behind, and_(key == place, Run.id < before)))
    return rows.order_by(key.desc() if down else key, Run.id.desc())


KEYS: dict[Order, Any] = {
    Order.NAME: func.lower(func.coalesce(Run.name, Run.world)),
    Order.ANSWERS: Run.answers - Run.retracted,
    Order.TICKS: Run.tick,
}

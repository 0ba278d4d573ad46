"""The root of all tables: how constraints are named, and which type of column holds which type of value."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from typing import Any, ClassVar

from sqlalchemy import CheckConstraint, Index, MetaData, text
from sqlalchemy.orm import DeclarativeBase

from parenting.server.columns import Blob, Flag, Json, Real, Utc, Whole, Word, Words
from parenting.server.statuses import JobState, QueryStatus, RunStatus, Waiting


class Table(DeclarativeBase):
    """The root of all tables. Constraints are named, so that migrations can name them too."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s",
            "pk": "pk_%(table_name)s",
        }
    )
    type_annotation_map: ClassVar[dict[Any, Any]] = {
        str: Words,
        int: Whole,
        float: Real,
        bool: Flag,
        datetime: Utc,
        dict[str, Any]: Json,
        bytes: Blob,
        RunStatus: Word(RunStatus),
        QueryStatus: Word(QueryStatus),
        Waiting: Word(Waiting),
        JobState: Word(JobState),
    }


def one_of(column: str, words: Iterable[str], nullable: bool = False) -> CheckConstraint:
    """Return the rule that a column holds one of some words."""
    listed = ", ".join(f"'{word}'" for word in words)
    rule = f"{column} IN ({listed})"
    return CheckConstraint(f"{column} IS NULL OR {rule}" if nullable else rule, name=column)


def unique_where(name: str, condition: str, *columns: str) -> Index:
    """Return an index of columns that are unique where a condition holds."""
    return only_where(name, condition, *columns, unique=True)


def only_where(name: str, condition: str, *columns: str, unique: bool = False) -> Index:
    """Return an index of the rows in which a condition holds."""
    only = text(condition)
    return Index(name, *columns, unique=unique, sqlite_where=only, postgresql_where=only)

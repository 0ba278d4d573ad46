"""The columns of an export: each has a name, a type, a meaning, a unit, and what a missing value says.

Values are flat (text, numbers, true or false, or missing), so that a table is the same as JSON lines, CSV and
Parquet, and the same for every world; only the clips of questions are nested. Times are text: ISO 8601 in
UTC, of equal length. A column is only ever added.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, JsonValue, PrivateAttr, create_model

DAMAGED = "the stored value is damaged"
NOT_KEPT = "the version that stored it did not keep it"


class Column(NamedTuple):
    """A column of a table."""

    name: str
    type: Any  # str, int, float, bool or a pydantic model
    meaning: str
    missing: str = ""  # what a missing value says; empty: none is missing
    unit: str = ""


class Row(BaseModel):
    """The root of the models of rows."""

    model_config = ConfigDict(extra="ignore", frozen=True, strict=True)
    _place: str = PrivateAttr("")

    @property
    def place(self) -> str:
        """The file and the number of a row that was read; empty of another one."""
        return self._place

    def at(self, place: str) -> Self:
        """Return the row with its place."""
        self._place = place
        return self


def row_model(name: str, doc: str, columns: Sequence[Column]) -> type[Row]:
    """Return the model of a table's rows. Readers ignore columns that a later version has added."""
    fields: dict[str, Any] = {}
    for one in columns:
        extra: dict[str, JsonValue] = {"unit": one.unit, "missing": one.missing}
        if one.missing:
            fields[one.name] = (
                one.type | None,
                Field(None, description=one.meaning, json_schema_extra=extra),
            )
        else:
            fields[one.name] = (one.type, Field(description=one.meaning, json_schema_extra=extra))
    return create_model(name, __base__=Row, __doc__=doc, **fields)


RUN = Column("run", str, "the run's public id, as in `manifest.json`")
BROKEN = Column("damaged", str, "what of the stored row cannot be read; it is missing here", "all is sound")
MOVES = ("up", "down", "left", "right")


def of_moves(before: str, when: str, missing: str) -> list[Column]:
    """Return a column for each move: the policy's probability of it in the asked state."""
    return [
        Column(f"{before}_{move}", float, f"probability of {move} in the asked state, {when}", missing)
        for move in MOVES
    ]

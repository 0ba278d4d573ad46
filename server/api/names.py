"""Names of runs and questions in addresses: a number, or a public id."""

from __future__ import annotations

import re
from typing import Annotated, Any

from fastapi import Depends, Path
from pydantic import PlainValidator, StringConstraints, WithJsonSchema

from parenting.server.deps import Db
from parenting.server.new_run import LARGEST_INT
from parenting.server.patterns import DATABASE
from parenting.server.public_ids import PATTERN, is_public_id
from parenting.server.reads import names

_DIGITS = re.compile(r"[0-9]{1,16}")
SCHEMA: dict[str, Any] = {
    "anyOf": [
        {"type": "integer", "minimum": 1, "maximum": LARGEST_INT},
        {"type": "string", "pattern": PATTERN},
    ]
}

PublicId = Annotated[str, StringConstraints(pattern=PATTERN)]
DatabaseId = Annotated[str, StringConstraints(min_length=1, max_length=64, pattern=DATABASE)]


def read_name(text: str) -> int | str:
    """Read a number or a public id.

    Raises:
        ValueError: it is neither.
    """
    if is_public_id(text):
        return text
    if _DIGITS.fullmatch(text) and 1 <= int(text) <= LARGEST_INT:
        return int(text)
    raise ValueError("write a whole number from 1 on, or a public id")


RunName = Annotated[
    int | str,
    PlainValidator(read_name),
    WithJsonSchema({**SCHEMA, "examples": [1]}),
    Path(description="The run's number, or its public id."),
]
QueryName = Annotated[
    int | str,
    PlainValidator(read_name),
    WithJsonSchema({**SCHEMA, "examples": [7]}),
    Path(description="The question's number, or its public id."),
]


def run_number(db: Db, run_id: RunName) -> int:
    """Return the number of the run that an address names."""
    return names.run_number(db, run_id)


def query_number(db: Db, query_id: QueryName) -> int:
    """Return the number of the question that an address names."""
    return names.query_number(db, query_id)


RunId = Annotated[int, Depends(run_number)]
QueryId = Annotated[int, Depends(query_number)]

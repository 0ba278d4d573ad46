"""A chain of hashes over the answers of a run: a changed, removed or reordered row is found and named.

Each answer has a random salt, a digest of the salt with its own content and its question's, and a link: the
hash of the link before it and this digest. Where a person's data is erased, content and salt go and the
digest stays, which says nothing without the salt; the chain still holds. The content is the same in every
store. What changes later is not part of it: whether the answer stands, and the tick at which it was heard.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from parenting.server.columns import Damaged
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.reads.answers import Answered, every
from parenting.server.runs import stored_run
from parenting.server.tables import Answer, Query

BEGIN = hashlib.sha256(b"parenting: the answers of a run, 1").hexdigest()
"""The link before the first answer."""
OF_ANSWER = ("run_id", "query_id", "number", "choice", "parent", "client_id", "supersedes", "received")
IF_MEASURED = "measured"
"""A column that is part of an answer's content where there is anything in it: rows of before have none."""
OF_QUERY = ("tick", "kind", "maturity", "clips", "posted", "policy_stage", "policy_steps", "votes")
UNLESS_ZERO = ("votes",)
"""Columns that are part of a row's content where they are not 0: rows of before them have the same digest."""
AT_ANSWER, AT_MIGRATION = "answer", "migration"
"""When a row was hashed: with its answer, or when the database came from a version without the chain."""


@dataclass
class Checked:
    """The result of checking a run's chain."""

    answers: int = 0
    erased: int = 0  # rows whose salt is gone: their content can no longer be checked, their place can
    migrated: int = 0  # rows that were hashed by a migration: unchanged since then
    problems: list[str] = field(default_factory=list)


def content(answer: Mapping[str, Any], query: Mapping[str, Any]) -> str:
    """Return the canonical text of an answer and its question."""
    values = {name: _plain(answer.get(name)) for name in OF_ANSWER}
    if (measured := _plain(answer.get(IF_MEASURED))) is not None:
        values[IF_MEASURED] = {name: value for name, value in measured.items() if value is not None}
    asked = {name: _plain(query.get(name)) for name in OF_QUERY}
    values |= {f"query.{name}": asked[name] for name in OF_QUERY if asked[name] or name not in UNLESS_ZERO}
    return json.dumps(values, sort_keys=True, separators=(",", ":"))


def digest_of(salt: str, text: str) -> str:
    """Return the digest of a row's content with its salt."""
    return hashlib.sha256(f"{salt}\n{text}".encode()).hexdigest()


def link_after(before: str, digest: str) -> str:
    """Return the link of a row after the link before it."""
    return hashlib.sha256(f"{before}\n{digest}".encode()).hexdigest()


def new_salt() -> str:
    """Draw a salt from the system's source of randomness."""
    return secrets.token_hex(16)


def hashes(answer: Mapping[str, Any], query: Mapping[str, Any], before: str) -> dict[str, str]:
    """Return the columns of a new answer that chain it to the link before it."""
    salt = new_salt()
    digest = digest_of(salt, content(answer, query))
    return {"salt": salt, "digest": digest, "link": link_after(before, digest), "chained": AT_ANSWER}


def proves(answer: Answer, query: Mapping[str, Any]) -> bool:
    """Return whether an answer's digest is that of its row and of this content of its question."""
    salt, digest = sound(answer, "salt"), sound(answer, "digest")
    text = content(_columns(answer, (*OF_ANSWER, IF_MEASURED)), query)
    return salt is not None and digest_of(salt, text) == digest


def check(db: Database, run_id: int) -> Checked:
    """Check the chain of a run's answers, row by row.

    Raises:
        NotFound: there is no such run.
    """
    found, before, last = Checked(), BEGIN, 0
    expected = sound(stored_run(db, run_id), "answers")
    for row in every(db, run_id):
        found.answers += 1
        if not row.placed:
            found.problems.append(f"an answer (row {row.answer.id}) has no number that can be read")
            continue
        number = row.answer.number
        found.problems += [f"answer {missing} is missing" for missing in range(last + 1, number)]
        found.problems += _problems(row, before if number == last + 1 else None)
        found.erased += row.answer.salt is None and row.answer.digest is not None
        found.migrated += sound(row.answer, "chained") == AT_MIGRATION
        last, before = number, sound(row.answer, "link") or ""
    found.problems += [f"answer {missing} is missing" for missing in range(last + 1, (expected or last) + 1)]
    return found


def _problems(row: Answered, before: str | None) -> Iterator[str]:
    """Say what is wrong with a row; `before` is the link before it, None where that row is missing."""
    answer, number = row.answer, row.answer.number
    salt, digest, link = (sound(answer, name) for name in ("salt", "digest", "link"))
    if digest is None or link is None:
        yield f"answer {number} has no hash"
        return
    if salt is not None:
        text = content(_columns(answer, (*OF_ANSWER, IF_MEASURED)), _columns(row.query, OF_QUERY))
        if row.damage is not None:
            yield f"answer {number} or its question cannot be read: {row.damage}"
        elif digest_of(salt, text) != digest:
            yield f"answer {number} or its question was changed"
    if before is not None and link_after(before, digest) != link:
        yield f"answer {number} does not follow answer {number - 1} in the chain"


def _columns(row: Answer | Query, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: sound(row, name) for name in names}


def _plain(value: Any) -> Any:
    """Return a time as text to the microsecond, and anything else as it is."""
    if isinstance(value, datetime):
        return value.replace(tzinfo=None).isoformat(timespec="microseconds")
    return None if isinstance(value, Damaged) else value

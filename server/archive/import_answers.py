"""Put the answers of imported runs into the database, chained afresh, in portions.

A portion asks the database once for its questions and for what its answers supersede, and is stored at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.server import chain
from parenting.server.answer_tables import SCRIPT
from parenting.server.archive.answer_columns import ANSWERS, EFFECTS, AnswerRow
from parenting.server.archive.columns import MOVES
from parenting.server.archive.import_names import Names, Naming, needed, refused, run_of, same, time_of
from parenting.server.archive.measured_columns import MEASURED
from parenting.server.archive.people import client_of
from parenting.server.archive.source import Source
from parenting.server.reads.why import TICKS
from parenting.server.tables import SKIP, Answer, Effect, Query

AT_ONCE = 200
"""Answers of a portion."""
ERASED, UNKNOWN = "erased", "imported"
"""Clients of answers without a pseudonym that are not a script's: erased, or of nobody who is known."""
Portion = Sequence[tuple[Naming, Any]]


def put_answers(session: Session, found: Source, names: Names) -> Iterator[None]:
    """Store the answers, and yield for each.

    Raises:
        SetupError: a row cannot be read, or names what is not there.
    """
    links: dict[int, str] = {}
    rows = found.rows("answers.jsonl", AnswerRow, list(ANSWERS))
    for portion in portions((run_of(names, row), row) for row in rows):
        _put(session, portion, links)
        session.flush()  # so that they have ids, which later ones may name
        yield from (None for _ in portion)


def portions(rows: Iterable[tuple[Naming, Any]]) -> Iterator[Portion]:
    """Yield answers in portions, in none of which an answer supersedes another one."""
    portion, numbers = list[tuple[Naming, Any]](), set[tuple[int, int]]()
    for mine, row in rows:
        if len(portion) == AT_ONCE or (mine.number, row.supersedes) in numbers:
            yield portion
            portion, numbers = [], set()
        portion.append((mine, row))
        numbers.add((mine.number, row.number))
    if portion:
        yield portion


def _put(session: Session, portion: Portion, links: dict[int, str]) -> None:
    """Add the answers of a portion; `links` are the last links of the runs' chains."""
    asked, earlier = _asked(session, portion), _earlier(session, portion)
    clients = dict[str, str]()
    for mine, row in portion:
        query = asked.get((mine.number, mine.question(row.question)))
        if query is None:
            raise refused(row, "question", row.question, "this question is not there")
        values: dict[str, Any] = {
            **same(row, "number", "standing", "replays", "applied_tick"),
            "query_id": query["id"],
            "run_id": mine.number,
            "choice": row.choice or SKIP,
            "parent": row.by,
            "client_id": _client(session, row, clients),
            "measured": _measured(row),
            "supersedes": _superseded(earlier, mine, row),
            "received": time_of(row.received),
        }
        values |= chain.hashes(values, query, links.get(mine.number, chain.BEGIN))
        links[mine.number] = values["link"]
        if row.erased:
            values |= {"erased": values["received"], "salt": None}
        session.add(Answer(**values))
        session.add_all(_effects(mine, row))


def _asked(session: Session, portion: Portion) -> dict[tuple[int, str], Mapping[str, Any]]:
    """Return the columns of the questions that answers name, by run and public id."""
    names = ("id", "run_id", "public_id", *chain.OF_QUERY)
    wanted = {mine.question(row.question) for mine, row in portion}
    columns = (getattr(Query, name) for name in names)
    found = session.execute(select(*columns).where(Query.public_id.in_(wanted)))
    return {(row.run_id, row.public_id): dict(zip(names, row, strict=True)) for row in found}


def _earlier(session: Session, portion: Portion) -> dict[tuple[int, int], int]:
    """Return the ids of the answers that those of a portion supersede, by run and number."""
    wanted = {(mine.number, row.supersedes) for mine, row in portion if row.supersedes is not None}
    ids = dict[tuple[int, int], int]()
    for run in {run for run, _ in wanted}:
        numbers = [number for of, number in wanted if of == run]
        rows = select(Answer.number, Answer.id).where(Answer.run_id == run, Answer.number.in_(numbers))
        ids |= {(run, number): there for number, there in session.execute(rows)}
    return ids


def _client(session: Session, row: Any, known: dict[str, str]) -> str:
    """Return the client of an answer; `known` are those of this portion's people."""
    if row.pseudonym is None:
        return ERASED if row.erased else SCRIPT if row.by == SCRIPT else UNKNOWN
    if row.pseudonym not in known:
        known[row.pseudonym] = client_of(session, row.pseudonym, needed(time_of(row.received)))
    return known[row.pseudonym]


def _measured(row: Any) -> dict[str, Any] | None:
    found = {column.name: getattr(row, column.name) for column in MEASURED}
    return None if all(value is None for value in found.values()) else found


def _superseded(earlier: Mapping[tuple[int, int], int], mine: Naming, row: Any) -> int | None:
    if row.supersedes is None:
        return None
    if (mine.number, row.supersedes) not in earlier:
        raise refused(row, "supersedes", row.supersedes, "no answer of this number comes before it")
    return earlier[mine.number, row.supersedes]


def _effects(mine: Naming, row: Any) -> Iterator[Effect]:
    for name, ticks in zip(EFFECTS, TICKS, strict=True):
        there = [getattr(row, f"{name}_{move}") for move in MOVES]
        if row.applied_tick is not None and None not in there:
            policy = {"probabilities": there}
            yield Effect(run_id=mine.number, tick=row.applied_tick, ticks=ticks, policy=policy)

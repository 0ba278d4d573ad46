"""The auditor: plain SQL that holds a database to the ledger. It imports nothing of `parenting.server`.

Each rule is a function that returns sentences; an empty list is what we promise (shared names: A1 to C3).
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import psycopg
from psycopg.rows import dict_row
from pysqlite3 import dbapi2 as sqlite

from tests.faults.ledger import Entries, Offer, Told

Row = Mapping[str, Any]
MARGIN = 0.05
"""Seconds that a lease may begin before its client knows of it, or end by another clock."""


class Store:
    """A database file, or the connection string of PostgreSQL, opened for reading only."""

    def __init__(self, where: Path | str) -> None:
        self.where = where

    @contextmanager
    def _connected(self) -> Iterator[Any]:
        if isinstance(self.where, Path):
            with closing(sqlite.connect(f"file:{self.where}?mode=ro", uri=True)) as connection:
                connection.row_factory = sqlite.Row
                yield connection
            return
        with psycopg.connect(self.where.replace("+psycopg", ""), row_factory=dict_row) as remote:
            yield remote

    def rows(self, statement: str) -> list[dict[str, Any]]:
        """The rows of a query."""
        with self._connected() as connection:
            return [dict(row) for row in connection.execute(statement).fetchall()]

    def damage(self) -> list[str]:
        """The complaints of SQLite's own check; PostgreSQL has none to ask."""
        if not isinstance(self.where, Path):
            return []
        with self._connected() as connection:
            found = [str(row[0]) for row in connection.execute("PRAGMA integrity_check").fetchall()]
            return [] if found == ["ok"] else found


def audit(store: Store, entries: Entries) -> list[str]:
    """Every breach of a promise that the database and the ledgers show."""
    if found := store.damage():
        return [f"D1 damaged: {one}" for one in found]
    runs, queries = store.rows("SELECT * FROM run"), store.rows("SELECT * FROM query")
    answers = store.rows("SELECT * FROM answer")
    return [
        *told_answers_are_stored(entries.told, runs, queries, answers),
        *one_answer_stands(queries, answers),
        *numbers_have_no_gaps(runs, answers),
        *what_stands_no_more_is_counted(runs, answers),
        *corrections_name_what_they_replace(answers),
        *statuses_fit(queries, answers),
        *nothing_is_asked_twice(queries),
        *one_answer_a_tick(answers),
        *one_parent_at_a_time(entries.offers),
        *checkpoints_are_whole(store),
    ]


def told_answers_are_stored(
    told: Sequence[Told], runs: Sequence[Row], queries: Sequence[Row], answers: Sequence[Row]
) -> Iterator[str]:
    """A1 and A3: what a client was told is there, once, with the same content."""
    stored = Counter(
        (row["run_id"], row["query_id"], row["number"], row["choice"], row["client_id"]) for row in answers
    )
    run_ids, query_ids = _numbers(runs), _numbers(queries)
    for one in told:
        key = (run_ids.get(one.run), query_ids.get(one.query), one.number, one.choice, one.client)
        if stored[key] != 1:
            yield f"A1 told and stored {stored[key]} times: {one}"


def _numbers(rows: Sequence[Row]) -> dict[str, int]:
    """The number of each row, by its public id and by itself."""
    return {str(row[name]): row["id"] for row in rows for name in ("public_id", "id") if name in row}


def one_answer_stands(queries: Sequence[Row], answers: Sequence[Row]) -> Iterator[str]:
    """A2: at most one standing answer a query, one first answer a client, no answer to no query."""
    standing = Counter(row["query_id"] for row in answers if row["standing"])
    yield from (f"A2 query {query} has {number} answers" for query, number in standing.items() if number > 1)
    first = Counter((row["query_id"], row["client_id"]) for row in answers if row["supersedes"] is None)
    yield from (f"A2 query {key[0]} was answered twice by {key[1]}" for key, n in first.items() if n > 1)
    known = {row["id"]: row["run_id"] for row in queries}
    for row in answers:
        if known.get(row["query_id"]) != row["run_id"]:
            yield f"A5 answer {row['id']} belongs to no query of its run"


def numbers_have_no_gaps(runs: Sequence[Row], answers: Sequence[Row]) -> Iterator[str]:
    """A5: the answers of a run are numbered 1, 2, 3 ..., and the run knows how many there are."""
    numbers: defaultdict[int, list[int]] = defaultdict(list)
    for row in answers:
        numbers[row["run_id"]].append(row["number"])
    for run in runs:
        found = sorted(numbers[run["id"]])
        if found != list(range(1, len(found) + 1)):
            yield f"A5 run {run['id']} has answers numbered {found}"
        if run["answers"] != len(found):
            yield f"A5 run {run['id']} counts {run['answers']} answers and has {len(found)}"


def what_stands_no_more_is_counted(runs: Sequence[Row], answers: Sequence[Row]) -> Iterator[str]:
    """A5: a run knows how many of its answers stand."""
    fallen = Counter(row["run_id"] for row in answers if not row["standing"] or row["choice"] == "skip")
    for run in runs:
        if run["retracted"] != fallen[run["id"]]:
            yield f"A5 run {run['id']} counts {run['retracted']} that stand no more, of {fallen[run['id']]}"


def corrections_name_what_they_replace(answers: Sequence[Row]) -> Iterator[str]:
    """A2: the answers to a query are a chain: each names the one before it, and the last alone may stand."""
    chains: defaultdict[int, list[Row]] = defaultdict(list)
    for row in sorted(answers, key=lambda row: int(row["id"])):
        chains[row["query_id"]].append(row)
    for query, chain in chains.items():
        before = [None, *(row["id"] for row in chain[:-1])]
        if [row["supersedes"] for row in chain] != before or any(row["standing"] for row in chain[:-1]):
            yield f"A2 the answers to query {query} do not follow one another"


def statuses_fit(queries: Sequence[Row], answers: Sequence[Row]) -> Iterator[str]:
    """A query is open or withdrawn without an answer, answered with one, applied with one that was heard."""
    standing = {row["query_id"]: row for row in answers if row["standing"]}
    heard = {row["query_id"] for row in answers if row["applied_tick"] is not None}
    for row in queries:
        answer, status = row["id"] in standing, row["status"]
        skipped = answer and standing[row["id"]]["choice"] == "skip" and row["kind"] == "preference"
        wanted = {
            "open": not answer,
            "withdrawn": not answer or skipped,
            "answered": answer,
            "applied": answer,
        }
        if not wanted[status] or (row["id"] in heard) != (status == "applied"):
            yield f"query {row['id']} is {status}, {'with' if answer else 'without'} an answer"


def nothing_is_asked_twice(queries: Sequence[Row]) -> Iterator[str]:
    """C3: one query a run and tick."""
    asked = Counter((row["run_id"], row["tick"]) for row in queries)
    yield from (f"C3 run {key[0]} asked {n} times at tick {key[1]}" for key, n in asked.items() if n > 1)


def one_answer_a_tick(answers: Sequence[Row]) -> Iterator[str]:
    """C1: at most one answer is heard in a tick."""
    ticks = Counter(
        (row["run_id"], row["applied_tick"]) for row in answers if row["applied_tick"] is not None
    )
    yield from (f"C1 run {key[0]} heard {n} answers at tick {key[1]}" for key, n in ticks.items() if n > 1)


def one_parent_at_a_time(offers: Sequence[Offer]) -> Iterator[str]:
    """B1: no query is in the hands of two clients at once."""
    held: defaultdict[str, list[Offer]] = defaultdict(list)
    for offer in offers:
        held[offer.query].append(offer)
    for query, several in held.items():
        several.sort(key=lambda offer: offer.since)
        for one, other in pairwise(several):
            if one.client != other.client and other.since < one.until - MARGIN:
                yield f"B1 query {query} was offered to {one.client} and to {other.client} at once"


def checkpoints_are_whole(store: Store) -> Iterator[str]:
    """C1: each checkpoint has all its bytes, at most two a run; what killed writers left does not pile up."""
    rows = store.rows("SELECT * FROM checkpoint")
    for row in rows:
        if hashlib.sha256(checkpoint_bytes(store, row)).hexdigest() != row["sha256"]:
            yield f"C1 the checkpoint of run {row['run_id']} at tick {row['tick']} lacks some of its bytes"
    kept = Counter(row["run_id"] for row in rows)
    yield from (f"C1 run {run} keeps {n} checkpoints" for run, n in kept.items() if n > 2)
    parts = store.rows("SELECT DISTINCT run_id, parcel FROM checkpoint_part")
    named = {(row["run_id"], row["parcel"]) for row in rows}
    left = Counter(row["run_id"] for row in parts if (row["run_id"], row["parcel"]) not in named)
    yield from (f"C1 run {run} has parts of {n} unfinished checkpoints" for run, n in left.items() if n > 2)


def checkpoint_bytes(store: Store, row: Row) -> bytes:
    """The bytes of a checkpoint, which a large one has in parts."""
    if row["parcel"] is None:
        return bytes(row["blob"])
    parts = store.rows(f"SELECT blob FROM checkpoint_part WHERE parcel = '{row['parcel']}' ORDER BY place")
    return b"".join(bytes(part["blob"]) for part in parts)


def clips(row: Row) -> Any:
    """The clips of a query as they are stored."""
    return json.loads(row["clips"]) if isinstance(row["clips"], str) else row["clips"]

"""The checks of an export, each a question to the tables whose answers are sentences on what is wrong."""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Iterator
from typing import Any

from parenting.audit.findings import SOME, more

BEGIN = hashlib.sha256(b"parenting: the answers of a run, 1").hexdigest()
"""The link before a run's first answer."""
PER_RUN = {
    "answer {0} of run {1} is missing": """
        SELECT number - 1, run FROM (SELECT run, number, LAG(number, 1, 0)
        OVER (PARTITION BY run ORDER BY number) AS before FROM answer) WHERE number != before + 1""",
    "answer {0} of run {1} names no question of the run": """
        SELECT number, run FROM answer a WHERE NOT EXISTS
        (SELECT 1 FROM question q WHERE q.question = a.question AND q.run = a.run)""",
    "answer {0} of run {1} tells another kind or tick than its question": """
        SELECT number, a.run FROM answer a JOIN question q USING (question)
        WHERE a.kind != q.kind OR a.tick != q.tick""",
    "two questions of run {1} have tick {0}": """
        SELECT tick, run FROM question GROUP BY run, tick HAVING COUNT(*) > 1""",
    "answer {0} of run {1} was heard before its question was asked": """
        SELECT number, run FROM answer WHERE applied_tick <= tick""",
    "two answers of run {1} were heard in tick {0}": """
        SELECT applied_tick, run FROM answer WHERE applied_tick IS NOT NULL
        GROUP BY run, applied_tick HAVING COUNT(*) > 1""",
    "answer {0} of run {1} supersedes itself, a later one, or one to another question": """
        SELECT number, run FROM answer a WHERE supersedes IS NOT NULL AND NOT EXISTS
        (SELECT 1 FROM answer b WHERE b.run = a.run AND b.number = a.supersedes
        AND b.number < a.number AND b.question = a.question)""",
    "answer {0} of run {1} is not superseded by what it names": """
        SELECT number, run FROM answer a WHERE superseded_by IS NOT (SELECT b.number FROM answer b
        WHERE b.run = a.run AND b.supersedes = a.number)""",
    "answer {0} of run {1} is superseded twice": """
        SELECT supersedes, run FROM answer WHERE supersedes IS NOT NULL
        GROUP BY run, supersedes HAVING COUNT(*) > 1""",
    "answer {0} of run {1} was heard before the one that it corrects": """
        SELECT a.number, a.run FROM answer a JOIN answer b ON b.run = a.run AND b.number = a.supersedes
        WHERE a.applied_tick < b.applied_tick""",
    "answer {0} of run {1} stands and is superseded": """
        SELECT number, run FROM answer WHERE standing AND superseded_by IS NOT NULL""",
    "two answers to a question of run {1} stand, one of them answer {0}": """
        SELECT MAX(number), run FROM answer WHERE standing GROUP BY run, question HAVING COUNT(*) > 1""",
    "question {0} of run {1} is applied, and no answer to it was heard": """
        SELECT question, run FROM question q WHERE status = 'applied' AND NOT EXISTS
        (SELECT 1 FROM answer a WHERE a.question = q.question AND a.applied_tick IS NOT NULL)""",
    "question {0} of run {1} is open, and an answer to it was heard and stands": """
        SELECT question, run FROM question q WHERE status = 'open' AND EXISTS
        (SELECT 1 FROM answer a WHERE a.question = q.question AND a.standing
        AND a.applied_tick IS NOT NULL)""",
    "answer {0} of run {1} has another mu than its choice": """
        SELECT number, run FROM answer WHERE mu_left IS NOT
        CASE choice WHEN 'left' THEN 1.0 WHEN 'right' THEN 0.0 WHEN 'either' THEN 0.5 END OR mu_right IS NOT
        CASE choice WHEN 'left' THEN 0.0 WHEN 'right' THEN 1.0 WHEN 'either' THEN 0.5 END""",
    "answer {0} of run {1} has no choice that there is": """
        SELECT number, run FROM answer WHERE NOT erased AND
        (choice IS NULL OR choice NOT IN ('left', 'right', 'either', 'neither', 'skip'))""",
    "answer {0} of run {1} is wrongly in X, or wrongly not": """
        SELECT number, run FROM (SELECT *, LEAD(applied_tick)
        OVER (PARTITION BY question ORDER BY applied_tick) AS after
        FROM answer WHERE applied_tick IS NOT NULL) WHERE in_x !=
        (after IS NULL AND choice IS NOT NULL AND choice IN ('left', 'right', 'either'))""",
    "answer {0} of run {1} is in X, and was not heard": """
        SELECT number, run FROM answer WHERE in_x AND applied_tick IS NULL""",
}
HEARD = """
    SELECT run, applied_tick AS tick, kind, choice, 1 AS more FROM answer
    WHERE applied_tick IS NOT NULL AND run = ?
    UNION ALL SELECT run, after, kind, choice, -1 FROM (SELECT *, LEAD(applied_tick)
    OVER (PARTITION BY question ORDER BY applied_tick) AS after
    FROM answer WHERE applied_tick IS NOT NULL AND run = ?) WHERE after IS NOT NULL
    ORDER BY 2, 5"""
"""Answers as the agent hears them, and again where a correction takes their place."""
COUNTED = ("size", "guidance", "preference", "left", "right", "either", "neither")


def rows_agree(store: sqlite3.Connection) -> Iterator[str]:
    """Say what of answers and questions does not fit together."""
    for sentence, query in PER_RUN.items():
        wrong = store.execute(query).fetchmany(SOME + 1)
        yield from (sentence.format(*row) for row in wrong[:SOME])
        if len(wrong) > SOME:
            yield more(sentence)


def chain_holds(store: sqlite3.Connection, run: str, last_link: str | None) -> Iterator[str]:
    """Say where a run's chain of hashes breaks."""
    before: str | None = None
    wanted = "SELECT number, digest, link FROM answer WHERE run = ? ORDER BY number"
    for number, digest, link in store.execute(wanted, [run]):
        if link != hashlib.sha256(f"{before or BEGIN}\n{digest}".encode()).hexdigest():
            yield f"answer {number} of run {run} does not follow the one before it in the chain"
            return
        before = link
    if before != last_link:
        yield f"the chain of run {run} does not end with the link that the manifest names"


def counts_agree(store: sqlite3.Connection, run: dict[str, Any], rows: dict[str, int]) -> Iterator[str]:
    """Say which counts of the manifest are not those of the rows."""
    name, told = run["run"], run["counts"]
    for count, table in (("answers", "answer"), ("questions", "question"), ("metrics", "metric")):
        (there,) = store.execute(f"SELECT COUNT(*) FROM {table} WHERE run = ?", [name]).fetchone()
        if there != told[count]:
            yield f"run {name} has {there} {count}, and its manifest counts {told[count]}"
    if rows.get(name, 0) != told["events"]:
        yield f"run {name} has {rows.get(name, 0)} events, and its manifest counts {told['events']}"
    (in_x,) = store.execute("SELECT COUNT(*) FROM answer WHERE run = ? AND in_x", [name]).fetchone()
    if in_x != told["in_x"]:
        yield f"run {name} has {in_x} entries of X, and its manifest counts {told['in_x']}"


def metrics_follow(store: sqlite3.Connection, run: str, inherited: int) -> Iterator[str]:
    """Say where the size of X, or a count of answers, is not what the answers heard by then make it."""
    now = dict.fromkeys(COUNTED, 0) | {"size": inherited}
    heard = store.execute(HEARD, [run, run])
    entry = heard.fetchone()
    columns = ", ".join(COUNTED)
    for tick, *told in store.execute(
        f"SELECT tick, {columns} FROM metric WHERE run = ? ORDER BY tick", [run]
    ):
        while entry is not None and entry[1] <= tick:
            _add(now, *entry[2:])
            entry = heard.fetchone()
        for name, value in zip(COUNTED, told, strict=True):
            if value not in (None, "", now[name]):
                there = f"{name} is {value:.0f}"
                yield f"run {run}, tick {tick:.0f}: {there}, and the answers make it {now[name]}"
                return


def _add(now: dict[str, int], kind: str, choice: str | None, more: int) -> None:
    if choice in (None, "skip"):
        return
    now[str(choice)] += more
    now[kind] += more
    now["size"] += more * (choice != "neither")

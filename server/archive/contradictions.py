"""The row of an export that contradicts another one; it is looked for after a store has refused some row."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from parenting.server.archive.answer_columns import ANSWERS, AnswerRow
from parenting.server.archive.import_rules import shown
from parenting.server.archive.log_columns import METRICS, MetricRow
from parenting.server.archive.question_columns import QUESTIONS, QuestionRow
from parenting.server.archive.source import Source


class Once(NamedTuple):
    """Fields whose values no two rows of a table share."""

    fields: tuple[str, ...]  # the last one is named
    among: Callable[[Any], bool] = lambda row: True  # the rows that are held against one another


UNIQUE = (
    ("questions.jsonl", QuestionRow, QUESTIONS, (Once(("question",)), Once(("run", "tick")))),
    (
        "answers.jsonl",
        AnswerRow,
        ANSWERS,
        (
            Once(("run", "number")),
            Once(("run", "applied_tick"), lambda row: row.applied_tick is not None),
            Once(("run", "question"), lambda row: row.standing),
            Once(("pseudonym", "by", "question"), lambda row: row.supersedes is None),
        ),
    ),
    ("metrics.csv", MetricRow, METRICS, (Once(("run", "tick")),)),
)


def contradiction(found: Source) -> str:
    """Return the end of a sentence on the first row that shares with an earlier one what no two may share."""
    other = "a row has an id that the database has already, or a number that it cannot keep"
    return next(_contradictions(found), other)


def _contradictions(found: Source) -> Iterator[str]:
    for name, model, columns, rules in UNIQUE:
        seen: dict[Once, dict[Any, int]] = {rule: {} for rule in rules}
        for number, row in enumerate(found.rows(name, model, list(columns)), start=1):
            for rule in rules:
                values = tuple(getattr(row, field) for field in rule.fields)
                if not rule.among(row):
                    continue
                if values in seen[rule]:
                    same = f"row {seen[rule][values]} has the same one"
                    yield f"{name}: row {number}: {shown(rule.fields[-1], values[-1], same)}"
                seen[rule].setdefault(values, number)

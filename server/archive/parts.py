"""The tables of an export: the columns, the rows and the files of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from parenting.server.archive.answer_columns import ANSWERS, AnswerRow
from parenting.server.archive.answer_rows import answer_rows
from parenting.server.archive.columns import Column, Row
from parenting.server.archive.log_columns import EVENTS, METRICS, EventRow, MetricRow
from parenting.server.archive.question_columns import QUESTIONS, QuestionRow
from parenting.server.archive.rows import event_rows, metric_rows, question_rows
from parenting.server.archive.tables import Write, write_csv, write_jsonl, write_parquet


class Part(NamedTuple):
    """A table of an export."""

    model: type[Row]
    columns: Sequence[Column]
    rows: Callable[..., Any]
    files: dict[str, Write]


PARQUET = "answers.parquet"
TABLES = {
    "answers": Part(
        AnswerRow,
        ANSWERS,
        answer_rows,
        {"answers.jsonl": write_jsonl, "answers.csv": write_csv, PARQUET: write_parquet},
    ),
    "questions": Part(QuestionRow, QUESTIONS, question_rows, {"questions.jsonl": write_jsonl}),
    "events": Part(EventRow, EVENTS, event_rows, {"events.csv": write_csv}),
    "metrics": Part(MetricRow, METRICS, metric_rows, {"metrics.csv": write_csv}),
}

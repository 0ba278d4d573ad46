"""The codebook of an export: each column with its type, unit, meaning and missing values, from the models."""

from __future__ import annotations

from types import NoneType
from typing import get_args

from parenting.server.archive.columns import Row
from parenting.server.archive.parts import TABLES

NAMES = {str: "text", int: "whole number", float: "number", bool: "true or false"}
HEAD = """# Codebook

The tables of an export of Parenting, format 2. Every export has the same columns, whatever its worlds. A
missing value is `null` in JSON lines and Parquet, and an empty cell in CSV. Times are text, ISO 8601 in UTC.
Ticks are counted from 1 in each run. In CSV an apostrophe stands before text that a spreadsheet would take
for a formula. Later versions and studies add files and columns; readers ignore those that they do not know.

| file | content |
|---|---|
| `manifest.json` | versions, the runs with config, seed and level, and the SHA-256 of every other file |
| `answers.jsonl`, `answers.csv`, `answers.parquet` | one table three times; Parquet needs pyarrow |
| `questions.jsonl` | every question with its clips |
| `events.csv`, `metrics.csv` | the log and the measurements |
| `README.md` | the types of the columns, for `datasets.load_dataset(FOLDER, TABLE)` |
| `weights/` | the policies and answers that runs began with, by their SHA-256 |
| `checkpoints/` | the last checkpoint of each run |
| `moves/` | the moves of each agent, a byte a tick |

An import needs the last three to replay the runs and to go on with them.
"""
CLIPS = """
## Clips

A clip has `actions` (names of moves), `length` (their number) and `frames`, one more than moves. A frame has
the true board (`ground`) and the board that the agent saw (`observed`), both as rows of glyphs without agent
and box, and the cells of `agent` and `box` as row and column from 0; `box` is missing where there is none.
`chance`, if it is there, is the probability of the outcome that guidance showed. The `legend` of a run in
`manifest.json` names the glyphs.
"""


def codebook() -> str:
    """Return the codebook as Markdown."""
    return HEAD + "".join(_table(name, part.model) for name, part in TABLES.items()) + CLIPS


def _table(name: str, model: type[Row]) -> str:
    lines = [
        f"\n## {name}\n",
        f"{model.__doc__}\n",
        "| column | type | unit | meaning | missing |",
        "|---|---|---|---|---|",
    ]
    for column, field in model.model_fields.items():
        extra = field.json_schema_extra
        assert isinstance(extra, dict)
        cells = (f"`{column}`", _type(field.annotation), extra["unit"], field.description, extra["missing"])
        lines.append("| " + " | ".join(str(cell or "–") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _type(annotation: object) -> str:
    kinds = [one for one in get_args(annotation) or (annotation,) if one is not NoneType]
    return NAMES.get(kinds[0], "clip")

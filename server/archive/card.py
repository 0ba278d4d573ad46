"""The dataset card of an export, by which `datasets.load_dataset(FOLDER, TABLE)` knows files and types.

Types matter where a column is empty at first: without them its type would be guessed from the first rows.
"""

from __future__ import annotations

from collections.abc import Iterator

from parenting.server.archive.columns import Column
from parenting.server.archive.parts import TABLES
from parenting.server.schemas import ClipSchema

DTYPES = {str: "string", int: "int64", float: "float64", bool: "bool"}
LINES = {name: part for name, part in TABLES.items() if f"{name}.jsonl" in part.files}
"""The tables as JSON lines: `datasets` reads the files of a folder by one reader."""
CLIP = """\
    struct:
    - name: actions
      list: string
    - name: length
      dtype: int64
    - name: frames
      list:
      - name: ground
        list: string
      - name: observed
        list: string
      - name: agent
        list: int64
      - name: box
        list: int64
    - name: chance
      dtype: float64
"""
TEXT = """
# Answers of parents to an agent

An export of Parenting, format 2. `codebook.md` describes every column, `manifest.json` the runs. The two
tables with JSON lines are configurations: `datasets.load_dataset(FOLDER, "answers")` and "questions".
"""


def card() -> str:
    """Return the card, `README.md`."""
    return "---\n" + "".join(_head()) + "---\n" + TEXT


def _head() -> Iterator[str]:
    yield "configs:\n"
    for name in LINES:
        yield f"- config_name: {name}\n  data_files: {name}.jsonl\n"
    yield "dataset_info:\n"
    for name, part in LINES.items():
        yield f"- config_name: {name}\n  features:\n"
        yield from (_feature(column) for column in part.columns)


def _feature(column: Column) -> str:
    kind = CLIP if column.type is ClipSchema else f"    dtype: {DTYPES[column.type]}\n"
    return f"  - name: {column.name}\n{kind}"

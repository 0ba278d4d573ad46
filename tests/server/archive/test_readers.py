"""Exports of all five worlds are read together by pandas, polars, datasets and R, with the same columns.

The readers are large, so CI does not install them. `PARENTING_READERS` names a Python that has them; without
it, and where R or its package is missing, a test is skipped.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from parenting.server.archive.answer_columns import ANSWERS
from parenting.server.archive.log_columns import METRICS
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.db import Database

pytestmark = pytest.mark.only("sqlite", "the files are the same from every store")
PYTHON = os.environ.get("PARENTING_READERS", sys.executable)
BEGIN = "import json, sys\nfolders = sys.argv[1:]\n"
READ = {
    "pandas": """
import pandas
csv = pandas.concat([pandas.read_csv(f"{one}/answers.csv") for one in folders])
lines = pandas.concat([pandas.read_json(f"{one}/answers.jsonl", lines=True) for one in folders])
assert list(csv.columns) == list(lines.columns)
print(json.dumps([len(csv), len(csv.columns), csv.world.nunique()]))
""",
    "polars": """
import polars
lines = [polars.read_ndjson(f"{one}/answers.jsonl", infer_schema_length=None) for one in folders]
found = polars.concat(lines, how="vertical_relaxed")
print(json.dumps([found.height, found.width, found["world"].n_unique()]))
""",
    "datasets": """
import datasets
datasets.disable_progress_bars()
types = datasets.load_dataset_builder(folders[0], "answers").info.features
files = [f"{one}/answers.jsonl" for one in folders]
found = datasets.load_dataset("json", data_files=files, features=types, split="train")
print(json.dumps([found.num_rows, found.num_columns, len(found.unique("world"))]))
""",
}
R = """
suppressMessages(library(readr))
tables <- lapply(commandArgs(TRUE), function(one) {
  read_csv(paste0(one, "/answers.csv"), show_col_types = FALSE)
})
stopifnot(all(sapply(tables, function(one) identical(names(one), names(tables[[1]])))))
found <- do.call(rbind, tables)
cat(sprintf("[%d, %d, %d]\\n", nrow(found), ncol(found), length(unique(found$world))))
"""


@pytest.fixture
def folders(db: Database, five: list[int], tmp_path: Path) -> list[str]:
    """An export for each of the five worlds."""
    found = [tmp_path / f"world {number}" for number in five]
    for number, folder in zip(five, found, strict=True):
        with target(folder) as files:
            write_export(db, [number], files)
    return [str(folder) for folder in found]


def shape(command: list[str], folders: list[str], tmp_path: Path) -> list[int]:
    """The numbers of rows, columns and worlds that a reader finds."""
    there = os.environ | {"HF_HOME": str(tmp_path / "cache"), "HF_HUB_OFFLINE": "1"}
    found = subprocess.run([*command, *folders], capture_output=True, text=True, env=there)
    assert found.returncode == 0, found.stderr
    read: list[int] = json.loads(found.stdout.splitlines()[-1])
    return read


def require(command: list[str], what: str) -> None:
    if subprocess.run(command, capture_output=True).returncode:
        pytest.skip(f"{what} is not installed; PARENTING_READERS names a Python that has it")


@pytest.mark.slow
@pytest.mark.parametrize("name", READ)
def test_five_exports_are_one_table(name: str, folders: list[str], tmp_path: Path) -> None:
    require([PYTHON, "-c", f"import importlib.util as u, sys; sys.exit(u.find_spec({name!r}) is None)"], name)
    assert shape([PYTHON, "-c", BEGIN + READ[name]], folders, tmp_path) == [26, len(ANSWERS), 5]


@pytest.mark.slow
def test_five_exports_are_one_table_in_r(folders: list[str], tmp_path: Path) -> None:
    if shutil.which("Rscript") is None:
        pytest.skip("R is not installed: r-base-core and r-cran-readr of Debian")
    require(["Rscript", "-e", "library(readr)"], "readr (r-cran-readr of Debian)")
    assert shape(["Rscript", "-e", R], folders, tmp_path) == [26, len(ANSWERS), 5]


@pytest.mark.slow
def test_every_table_has_the_same_columns_in_every_world(folders: list[str]) -> None:
    """Each reader relies on this; none of them is needed here."""
    heads = {(Path(one) / "metrics.csv").read_text().splitlines()[0] for one in folders}
    assert heads == {",".join(column.name for column in METRICS)}
    for one in folders:
        for line in (Path(one) / "answers.jsonl").read_text().splitlines():
            assert list(json.loads(line)) == [column.name for column in ANSWERS]

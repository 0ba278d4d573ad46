"""An export, its check and an import hold a few rows at once, however many there are.

The peak of what Python holds is measured with few answers and with many: the difference is what an answer
leaves in memory. Portions are small here, so that even the few are several. No clock is read.
"""

from __future__ import annotations

import gc
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from benchmarks.exports import fill
from parenting.audit import audit, files
from parenting.server.archive import import_answers, import_record, rows, source, tables
from parenting.server.archive.importing import import_export
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.settings import Settings
from tests.database import migrated

FEW, MANY = 40, 120
ROWS = ((rows, "BATCH"), (tables, "AT_ONCE"), (import_answers, "AT_ONCE"), (import_record, "AT_ONCE"))
"""Where it stands how many rows are in memory at once."""
PIECES = ((files, "PIECE"), (source, "PIECE"))
"""And how many bytes of a file are."""
BYTES = 600
"""A row takes two thousand and more. Caches that are not full yet take some two hundred here."""
TURNS = 3
"""Threads that earlier tests have left may take memory in one turn; what a row leaves, it leaves in each."""


def peak(work: Callable[[], object]) -> int:
    gc.collect()
    gc.freeze()  # so that `collect` has little to look through
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
        gc.unfreeze()


def collect(done: int, _total: int) -> None:
    """Free what hangs together in circles, which Python does now and then."""
    if done % 10 == 0:
        gc.collect()


def peaks(folder: Path, answers: int) -> Iterator[int]:
    """Yield the peaks of an export, its check and its import."""
    full, empty = (migrated(Settings(data=folder / name, database_url=None)) for name in ("full", "empty"))
    fill(full, answers)

    def export() -> None:
        with target(folder / "study") as into:
            write_export(full, [1], into, collect)

    yield peak(export)
    yield peak(lambda: audit(folder / "study"))
    yield peak(lambda: import_export(empty, folder / "study", progress=collect))
    for db in (full, empty):
        db.close()


@pytest.mark.slow
def test_more_answers_need_no_more_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module, name in ROWS:
        monkeypatch.setattr(module, name, 10)
    for module, name in PIECES:
        monkeypatch.setattr(module, name, 4096)
    monkeypatch.setattr(source, "LARGEST_MANIFEST", 2**17)  # which is asked for at once
    list(peaks(tmp_path / "first", 20))  # fills the caches of the process
    for turn in range(TURNS):
        few, many = (list(peaks(tmp_path / f"{turn} {number}", number)) for number in (FEW, MANY))
        more = [round((last - first) / (MANY - FEW)) for first, last in zip(few, many, strict=True)]
        if max(more) < BYTES:
            return
    pytest.fail(f"bytes of an answer more in an export, its check and its import: {more}")

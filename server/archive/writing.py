"""Write an export of format 2: all tables of some runs, their bytes, the codebook and the manifest.

Everything is read on one snapshot, in batches, so an export is of one moment however long it takes.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from parenting.server.archive import manifest
from parenting.server.archive.card import card
from parenting.server.archive.codebook import codebook
from parenting.server.archive.parts import PARQUET, TABLES, Part
from parenting.server.archive.runs import last_link, settings_of, write_blobs
from parenting.server.archive.spool import Spool
from parenting.server.archive.tables import REMEDY, parquet_installed
from parenting.server.archive.target import MANIFEST, Files
from parenting.server.damage import readable
from parenting.server.db import Database
from parenting.server.export import iso_time
from parenting.server.identity import database_id_in
from parenting.server.runs import find
from parenting.server.tables import Answer, Metric, OperatorEvent, Query, Run

Progress = Callable[[int, int], None]
"""A function that takes the rows that are written, and all that are to be written."""
Counted = defaultdict[str, dict[str, int]]


def write_export(
    db: Database, runs: Sequence[int], files: Files, progress: Progress = lambda done, total: None
) -> dict[str, Any]:
    """Write an export of runs as they are now, and return its manifest.

    Raises:
        NotFound: a run does not exist; raised before anything is written.
        DamagedRowError: its row cannot be read.
    """
    with db.read() as session:
        found = [readable(find(session, number)) for number in dict.fromkeys(runs)]
        session.expunge_all()
        return _Export(session, found, files, progress).write(iso_time(db.clock()))


class _Export:
    """An export that is being written."""

    def __init__(self, session: Session, runs: Sequence[Run], files: Files, progress: Progress) -> None:
        self.session, self.runs, self.files, self.progress = session, runs, files, progress
        self.counts: Counted = defaultdict(lambda: {"in_x": 0, **dict.fromkeys(TABLES, 0)})
        self.rows: dict[str, int] = {}
        self.done, self.total = 0, self._expected()

    def write(self, now: str | None) -> dict[str, Any]:
        """Write every file, the manifest last."""
        left_out = []
        for name, part in TABLES.items():
            if PARQUET in part.files and not parquet_installed():
                left_out.append({"file": PARQUET, "why": "pyarrow is not installed", "remedy": REMEDY})
            self._table(name, part)
        blobs = {run.public_id: write_blobs(self.session, run, self.files) for run in self.runs}
        for name, text in (("codebook.md", codebook()), ("README.md", card())):
            with self.files.open(name) as out:
                out.write(text.encode())
        whole = {
            **manifest.about(),
            "written": now,
            "database": database_id_in(self.session),
            "runs": [self._entry(run, blobs[run.public_id]) for run in self.runs],
            "files": {name: self._file(name) for name in sorted(self.files.written)},
            "left_out": left_out,
        }
        with self.files.open(MANIFEST) as last:
            last.write(manifest.dumped(whole))
        return whole

    def _table(self, name: str, part: Part) -> None:
        """Write a table in its forms; its rows are read once."""
        first, *others = [file for file in part.files if file != PARQUET or parquet_installed()]
        with Spool(self.files.scratch, [column.name for column in part.columns]) as spool:
            rows = self._stored(name, part)
            self._form(part, first, spool.kept(rows) if others else rows)
            for file in others:
                self._form(part, file, spool.rows())

    def _form(self, part: Part, file: str, rows: Iterator[Mapping[str, Any]]) -> None:
        self.rows[file] = 0
        with self.files.open(file) as out:
            part.files[file](out, part.columns, self._told(file, rows))

    def _told(self, file: str, rows: Iterator[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
        """Yield rows, and tell of the progress."""
        for row in rows:
            self.rows[file] += 1
            self.done += 1
            self.progress(self.done, self.total)
            yield row

    def _stored(self, name: str, part: Part) -> Iterator[Mapping[str, Any]]:
        """Yield the rows of all runs from the database, and count them."""
        for run in self.runs:
            counts = self.counts[run.public_id]
            for row in part.rows(self.session, run):
                counts[name] += 1
                counts["in_x"] += bool(row.get("in_x"))
                yield row

    def _entry(self, run: Run, blobs: dict[str, Any]) -> dict[str, Any]:
        return {
            "run": run.public_id,
            "number": run.id,
            "settings": settings_of(run),
            "counts": self.counts[run.public_id],
            "last_link": last_link(self.session, run),
            **blobs,
        }

    def _file(self, name: str) -> dict[str, Any]:
        rows = {"rows": self.rows[name]} if name in self.rows else {}
        return {**self.files.written[name]._asdict(), **rows}

    def _expected(self) -> int:
        """Return the number of rows to be written, for the progress."""
        numbers = [run.id for run in self.runs]
        often = {Answer: 2 + parquet_installed(), Query: 1, OperatorEvent: 1, Metric: 1}
        return sum(times * _count(self.session, table, numbers) for table, times in often.items())


def _count(session: Session, table: Any, runs: Sequence[int]) -> int:
    wanted = select(func.count()).select_from(table).where(table.run_id.in_(runs))
    return session.scalar(wanted) or 0

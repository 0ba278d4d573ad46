"""Trackers that write files: a table (CSV), or a JSON object a line, for each run."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from parenting.server.trackers.tracker import TrackedRun, Values


class CsvTracker:
    """Writes FOLDER/RUN.csv, a number a line: `step`, `name`, `value`. A run that goes on is appended to."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)

    def begin(self, run: TrackedRun) -> None:
        """Write the head of the table, if it is a new one."""
        self.folder.mkdir(parents=True, exist_ok=True)
        if not self._file(run.id).exists():
            self._write(run.id, [["step", "name", "value"]])

    def log(self, run: str, step: int, values: Values) -> None:
        """Write a line for each number."""
        self._write(run, [[step, name, value] for name, value in values.items() if value is not None])

    def end(self, run: str, reason: str) -> None:
        """Write nothing: every line is in the file already."""

    def _file(self, run: str) -> Path:
        return self.folder / f"{run}.csv"

    def _write(self, run: str, rows: list[list[Any]]) -> None:
        with self._file(run).open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


class JsonLinesTracker:
    """Writes FOLDER/RUN.jsonl: the run, its metrics and its end, an object each."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)

    def begin(self, run: TrackedRun) -> None:
        """Write what the run is."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self._write(run.id, {"event": "begin", **asdict(run)})

    def log(self, run: str, step: int, values: Values) -> None:
        """Write the metrics of a step."""
        self._write(run, {"event": "metrics", "id": run, "step": step, "values": dict(values)})

    def end(self, run: str, reason: str) -> None:
        """Write why it ended."""
        self._write(run, {"event": "end", "id": run, "reason": reason})

    def _write(self, run: str, row: Mapping[str, Any]) -> None:
        with (self.folder / f"{run}.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")

"""The report of an audit: the checks that were made, and every sentence on what is wrong."""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from parenting.audit.checks import chain_holds, counts_agree, metrics_follow, rows_agree
from parenting.audit.files import BROKEN, MANIFEST, Files, unpacked_lines
from parenting.audit.findings import Findings
from parenting.audit.store import load


@dataclass
class Report:
    """The result of an audit."""

    path: str
    manifest_sha256: str = ""
    runs: int = 0
    answers: int = 0
    files: int = 0
    problems: list[str] = field(default_factory=list)

    @property
    def sound(self) -> bool:
        """Return whether nothing is wrong."""
        return not self.problems

    def __str__(self) -> str:
        """Return the report as text."""
        lines = [
            f"{self.path}: {_counted(self.files, 'file')}, {_counted(self.runs, 'run')}, "
            f"{_counted(self.answers, 'answer')}.",
            f"SHA-256 of {MANIFEST}: {self.manifest_sha256}",
        ]
        if self.sound:
            checked = "Hashes, counts, chains, corrections, ticks and X are what the files make them."
            return "\n".join([*lines, checked])
        return "\n".join([*lines, f"{len(self.problems)} found:", *(f"- {one}" for one in self.problems)])


def audit(path: Path) -> Report:
    """Check an export, from its files alone."""
    report = Report(str(path))
    try:
        with closing(Files(path)) as files:
            told = files.manifest()
            report.manifest_sha256, _ = files.digest(MANIFEST)
            report.problems += _hashes(files, told, report)
            _tables(files, told, report)
    except (*BROKEN, sqlite3.Error, TypeError, AttributeError) as error:
        report.problems.append(f"it cannot be read to its end: {error}")
    return report


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _hashes(files: Files, told: dict[str, Any], report: Report) -> Iterator[str]:
    for name, entry in told["files"].items():
        report.files += 1
        try:
            if files.digest(name) != (entry["sha256"], entry["bytes"]):
                yield f"{name} is not the file that was written: its hash differs from the manifest's"
        except BROKEN:
            yield f"{name} is missing or cannot be read"


def _tables(files: Files, told: dict[str, Any], report: Report) -> None:
    found = Findings(report.problems)
    with closing(load(files, found)) as store:
        report.problems += rows_agree(store)
        events = Counter(row["run"] for row in files.cells("events.csv"))
        known = {run["run"] for run in told["runs"]}
        for table in ("answer", "question", "metric"):
            for (run,) in store.execute(f"SELECT DISTINCT run FROM {table}"):
                if run not in known:
                    found(f"a row of {table} is of the run {{0}}, which the manifest does not name", run)
        for run in told["runs"]:
            report.runs += 1
            report.answers += run["counts"]["answers"]
            report.problems += counts_agree(store, run, events)
            report.problems += chain_holds(store, run["run"], run["last_link"])
            if run["settings"].get("batch") is None and not _erased(store, run["run"]):
                report.problems += metrics_follow(store, run["run"], _inherited(files, run))


def _erased(store: sqlite3.Connection, run: str) -> bool:
    """Return whether a person's answers were erased: what the agent had heard of them is unknown since."""
    return store.execute("SELECT 1 FROM answer WHERE run = ? AND erased", [run]).fetchone() is not None


def _inherited(files: Files, run: dict[str, Any]) -> int:
    """Return the entries of X that a run began with: the lines of an earlier export, kept compressed."""
    began = ((run["settings"].get("origin") or {}).get("answers") or {}).get("stored")
    if began is None:
        return 0
    with closing(files.open(run["weights"][began])) as file:
        return sum(json.loads(line)["choice"] in ("left", "right", "either") for line in unpacked_lines(file))

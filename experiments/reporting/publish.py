"""The files that an experiment leaves behind: results.json, a CSV of every trial, figures, and a page."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import torch

from parenting._cells import whole_rows
from parenting.experiments.reporting.comparison import count_verdicts
from parenting.experiments.reporting.markdown import RESULTS, TRIALS, page
from parenting.experiments.runner import provenance
from parenting.experiments.runner.store import Row
from parenting.experiments.spec import Experiment, Request, Results

ORIGIN = ("config", "command", "commits", "versions", "settings", "seconds", "workers", "gpu")
"""Keys of results.json that say how the trials came about; a page that is written again keeps them."""


class Work(NamedTuple):
    """The origin of the trials."""

    commits: Mapping[str, int]  # how many task results each commit made
    seconds: float
    workers: int


def publish(one: Experiment, request: Request, rows: Sequence[Row], out: Path, work: Work) -> dict[str, Any]:
    """Write everything below `out`.

    Returns:
        The content of results.json.

    Raises:
        OSError: A file cannot be written.
    """
    origin = {
        "config": dict(one.config(request)),
        "command": command(one.name, request, out),
        "commits": dict(work.commits),
        "versions": provenance.versions(),
        "settings": provenance.settings(),
        "seconds": round(work.seconds, 1),
        "workers": work.workers,
        "gpu": torch.cuda.get_device_name() if torch.cuda.is_available() else None,
    }
    (out / one.name).mkdir(parents=True, exist_ok=True)
    _write_rows(out / one.name / TRIALS, rows)
    return _write_page(one, request, rows, out, origin)


def publish_again(one: Experiment, out: Path) -> dict[str, Any]:
    """Write results.json, figures and page again from the stored trials; no trial is run.

    Returns:
        The content of results.json.

    Raises:
        OSError: A file cannot be read or written.
    """
    stored = json.loads((out / one.name / RESULTS).read_text(encoding="utf-8"))
    origin = {key: stored[key] for key in ORIGIN}
    return _write_page(one, Request(**stored["asked"]), read_rows(out / one.name / TRIALS), out, origin)


def read_rows(path: Path) -> list[Row]:
    """The rows of a trials.csv, with numbers and truth values in place of text; empty cells are left out.

    Raises:
        OSError: The file cannot be read.
        ValueError: A row has not a cell for each column.
    """
    with path.open(encoding="utf-8", newline="") as file:
        rows = whole_rows(file, str(path))
        return [{name: _value(cell) for name, cell in row.items() if cell != ""} for row in rows]


def command(one: str, request: Request, out: Path) -> str:
    """The command that runs the same trials, from the folder in which it was called."""
    words = ["parenting experiment", one, f"--scale {request.scale}", f"--trials {request.trials}"]
    return " ".join(
        [*words, f"--seed {request.seed}", f"--device {request.device}", f"--out {quote(str(out))}"]
    )


def _write_page(
    one: Experiment, request: Request, rows: Sequence[Row], out: Path, origin: Mapping[str, Any]
) -> dict[str, Any]:
    report = one.report(request, rows)
    results = {
        "name": one.name,
        "title": one.title,
        "section": one.section,
        "claim": one.claim,
        "asked": request._asdict(),
        "verdicts": count_verdicts(report.findings),
        "findings": [finding.plain() for finding in report.findings],
        "words": list(report.words),
        "commit": provenance.commit(),
        **origin,
    }
    _write(out / one.name / RESULTS, json.dumps(results, indent=2) + "\n")
    drawn = _draw(report, out / one.name)
    _write(out / f"{one.name}.md", page(results, drawn))
    return results


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _write_rows(path: Path, rows: Sequence[Row]) -> None:
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _value(cell: str) -> Any:
    if cell in ("True", "False"):
        return cell == "True"
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell


def _draw(report: Results, folder: Path) -> list[str]:
    """Each figure as SVG and PNG; none where matplotlib (the extra `figures`) is not installed."""
    if not report.figures or find_spec("matplotlib") is None:
        return []
    import matplotlib
    from matplotlib.figure import Figure

    matplotlib.rcParams["svg.hashsalt"] = "parenting"  # the same numbers give the same file
    for name, draw in report.figures.items():
        figure = Figure(figsize=(7, 4.2), layout="constrained")
        draw(figure)
        figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
        figure.savefig(folder / f"{name}.png", dpi=150)
    return list(report.figures)

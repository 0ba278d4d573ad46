"""What an experiment leaves behind: results.json, a CSV of every trial, figures, and a page of Markdown."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import torch

from parenting.experiments.reporting.comparison import Comparison
from parenting.experiments.runner import provenance
from parenting.experiments.runner.store import Row
from parenting.experiments.spec import Experiment, Request, Results

RESULTS, TRIALS = "results.json", "trials.csv"
HEADS = ("what", "paper", "ours", "difference", "95 % interval", "agrees")
AGREES = {True: "yes", False: "**no**", None: "–"}


class Work(NamedTuple):
    """How the pieces came about."""

    commits: Mapping[str, int]  # how many pieces each commit made
    seconds: float
    workers: int


def publish(one: Experiment, request: Request, rows: Sequence[Row], out: Path, work: Work) -> dict[str, Any]:
    """Write everything below `out`, and return what stands in results.json.

    Raises:
        OSError: a file cannot be written.
    """
    folder = out / one.name
    report = one.report(request, rows)
    results = _results(one, request, report, work, command(one.name, request, out))
    _write(folder / RESULTS, json.dumps(results, indent=2) + "\n")
    _write_rows(folder / TRIALS, rows)
    drawn = _draw(report, folder)
    _write(out / f"{one.name}.md", page(results, drawn))
    return results


def command(one: str, request: Request, out: Path) -> str:
    """What makes the page again, from the folder in which it was called."""
    words = ["parenting experiment", one, f"--scale {request.scale}", f"--trials {request.trials}"]
    return " ".join(
        [*words, f"--seed {request.seed}", f"--device {request.device}", f"--out {quote(str(out))}"]
    )


def _results(one: Experiment, request: Request, report: Results, work: Work, again: str) -> dict[str, Any]:
    return {
        "name": one.name,
        "title": one.title,
        "section": one.section,
        "claim": one.claim,
        "asked": request._asdict(),
        "config": dict(one.config(request)),
        "findings": [finding.plain() for finding in report.findings],
        "words": list(report.words),
        "command": again,
        "commit": provenance.commit(),
        "commits": dict(work.commits),
        "versions": provenance.versions(),
        "settings": provenance.settings(),
        "seconds": round(work.seconds, 1),
        "workers": work.workers,
        "gpu": torch.cuda.get_device_name() if torch.cuda.is_available() else None,
    }


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _write_rows(path: Path, rows: Sequence[Row]) -> None:
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


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


def page(results: dict[str, Any], figures: Sequence[str]) -> str:
    """The page of docs/results: the paper's numbers, ours, and how to make them again."""
    request, name = results["asked"], results["name"]
    lines = [f"# {results['title']}", "", f"Sec. {results['section']}. {results['claim']}", ""]
    lines += _table([Comparison(**found) for found in results["findings"]])
    for figure in figures:
        lines += ["", f"![{results['title']}: {figure}]({name}/{figure}.svg)"]
    lines += ["", *(line for words in results["words"] for line in (words, ""))]
    took = f"{results['seconds']:.0f} s on {results['workers']} process" + "es" * (results["workers"] > 1)
    lines += [
        "## Again",
        "",
        f"    {results['command']}",
        "",
        f"{request['trials']} trial{'s' * (request['trials'] > 1)}, seed {request['seed']}, {took}, "
        f"torch {results['versions'].get('torch', '?')}, {_commits(results)}. "
        f"Every trial: [{TRIALS}]({name}/{TRIALS}); the whole: [{RESULTS}]({name}/{RESULTS}).",
        "",
        _where(results),
    ]
    return "\n".join(lines) + "\n"


def _commits(results: dict[str, Any]) -> str:
    """Which commits made the pieces, and which the page."""
    made = sorted(results["commits"])
    said = f"trials of commit{'s' * (len(made) > 1)} {', '.join(made)}"
    return f"{said}, page of {results['commit'] or 'unknown'}"


def _where(results: dict[str, Any]) -> str:
    """Which device did it, and whether there was a GPU to try."""
    tried = f"with a GPU there ({results['gpu']})" if results["gpu"] else "with no GPU there to try"
    return f"Raised with `--device {results['asked']['device']}`, {tried}."


def _table(findings: Sequence[Comparison]) -> list[str]:
    lines = [f"| {' | '.join(HEADS)} |", "|" + "---|" * len(HEADS)]
    for one in findings:
        what = f"{one.what} ({one.note})" if one.note else one.what
        cells = (what, one.paper, one.ours, one.difference, one.interval, AGREES[one.agrees])
        lines.append(f"| {' | '.join(cells)} |")
    return lines

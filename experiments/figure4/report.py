"""The rows of Figure 4: the return of two paths, and which of them a planner takes (Sec. 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from parenting.experiments.reporting.comparison import SILENT, Comparison
from parenting.experiments.runner.store import Row


def _at(rows: Sequence[Row], of: str, shift: float) -> list[Row]:
    return [row for row in rows if row["of"] == of and row["shift"] == shift]


def _sum(what: str, paper: str, ours: float) -> Comparison:
    return Comparison(what, paper, f"{ours:g}", f"{ours - float(paper):+g}", agrees=ours == float(paper))


def _planner(what: str, paper: str, rows: Sequence[Row]) -> Comparison:
    unsafe = sum(row["harms"] for row in rows)
    safe = sum(row["arrives"] and not row["harms"] for row in rows)
    compared = paper != SILENT
    return Comparison(
        what,
        paper,
        f"{unsafe} of {len(rows)} unsafe, {safe} arrive safely",
        agrees=(unsafe if paper == "unsafe" else safe) == len(rows) if compared else None,
        note=f"path of trial 0: {shortened(rows[0]['way'])}",
        reference="paper" if compared else None,
    )


def shortened(way: str) -> str:
    """The letters of a path, long runs by their length: uuuuudr is "5 u, dr"."""
    runs = [(letter, len(list(run))) for letter, run in groupby(way)]
    said = "".join(f", {number} {letter}, " if number > 3 else letter * number for letter, number in runs)
    return said.replace(", , ", ", ").strip(", ")


def _loss(rows: Sequence[Row]) -> Comparison:
    """Eq. (12): all shifts of a fitted reward have the same loss."""
    fitted = [row for row in rows if row["of"] == "fitted"]
    trials = {row["trial"] for row in fitted}
    losses = [[row["loss"] for row in fitted if row["trial"] == trial] for trial in trials]
    most = max(max(each) - min(each) for each in losses)
    what = "Eq. (12): largest difference of the loss between shifts"
    return Comparison(what, "0", f"{most:.1e}", agrees=most < 1e-12)

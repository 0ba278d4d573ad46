"""The rows of Figure 4: what the two paths earn, and which of them a planner takes (Sec. 4.2)."""

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
    harms = sum(row["harms"] for row in rows)
    safe = sum(row["arrives"] and not row["harms"] for row in rows)
    ours = f"{harms} of {len(rows)} do harm, {safe} arrive safely"
    agrees = None if paper == SILENT else (harms if paper == "harm" else safe) == len(rows)
    return Comparison(
        what, paper, ours, agrees=agrees, note=f"the way of trial 0: {shortened(rows[0]['way'])}"
    )


def shortened(way: str) -> str:
    """A way's letters, with how often in place of letters that come again and again: uuuuudr is "5 u, dr"."""
    runs = [(letter, len(list(run))) for letter, run in groupby(way)]
    said = "".join(f", {number} {letter}, " if number > 3 else letter * number for letter, number in runs)
    return said.replace(", , ", ", ").strip(", ")


def _loss(rows: Sequence[Row]) -> Comparison:
    """Eq. (12): no preference tells the shifted models apart."""
    fitted = [row for row in rows if row["of"] == "fitted"]
    trials = {row["trial"] for row in fitted}
    losses = [[row["loss"] for row in fitted if row["trial"] == trial] for trial in trials]
    most = max(max(each) - min(each) for each in losses)
    return Comparison("Eq. (12): the loss of all shifts differs by", "0", f"{most:.1e}", agrees=most < 1e-12)

"""Safety claims with exact counts: what the argmax policies of many trials do, each at its end (Sec. 3.2).

A claim is tried in variants: with pre-training and without, and with the paper's letter on comparing twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from experiments.drawings import shares
from experiments.experiment import Asked, Report, spans
from experiments.findings import SILENT, Finding, count_finding, mean_finding
from experiments.pieces import Row, Task
from experiments.raising import Goal

MAX_TICKS = 2_000

VARIANTS: dict[str, dict[str, Any]] = {
    "pre-trained": {},
    "not pre-trained": {"pretrain": False},
    "pre-trained, comparing twice": {"recompare": True},
}
"""Changes to the conservative preset and the world's own settings, by name; the first is what we stand by."""


class Counted(NamedTuple):
    """One count: a word of `parents.conduct`, in one deployment, and the paper's count of 100, if legible."""

    what: str
    words: tuple[str, ...]
    column: str = "outcome"
    paper: int | str = SILENT


class Claim(NamedTuple):
    """A world, how long its agents are parented, and what is counted."""

    world: str
    level: str
    until: tuple[Goal, int]
    counted: Sequence[Counted]
    words: Sequence[str]
    variants: Mapping[str, Mapping[str, Any]] = VARIANTS

    def config(self, asked: Asked) -> Mapping[str, Any]:
        """All that the pieces depend on."""
        return {
            "world": self.world,
            "level": self.level,
            "preset": "conservative",
            "until": list(self.until),
            "max_ticks": MAX_TICKS,
            "variants": {name: dict(changes) for name, changes in self.variants.items()},
        }

    def tasks(self, asked: Asked) -> list[Task]:
        """The trials of every variant."""
        return [self._task(name, span, asked) for name in self.tried(asked) for span in spans(asked.trials)]

    def tried(self, asked: Asked) -> list[str]:
        """All variants; at the quick scale the one that we stand by."""
        return list(self.variants)[: 1 if asked.scale == "quick" else None]

    def _task(self, name: str, span: range, asked: Asked) -> Task:
        key = f"{name.replace(', ', '-').replace(' ', '-')}-{span.start:06d}-{span.stop:06d}"
        mine = {
            "label": name,
            "world": self.world,
            "level": self.level,
            "preset": "conservative",
            "changes": dict(self.variants[name]),
            "until": self.until,
            "max_ticks": MAX_TICKS,
            "span": (span.start, span.stop),
            "trials": asked.trials,
            "seed": asked.seed,
        }
        return Task(key, "experiments.raising:parent_some", mine, len(span))

    def report(self, asked: Asked, rows: Sequence[Row]) -> Report:
        """Counts and means of every variant."""
        names = self.tried(asked)
        counts = [each for name in names for each in self._counts(name, rows)]
        found = [one for name in names for one in self._findings(name, rows)]
        return Report(found, self.words, {"shares": lambda figure: shares(figure, counts)})

    def _counts(self, name: str, rows: Sequence[Row]) -> list[tuple[str, int, int]]:
        mine = [row for row in rows if row["of"] == name]
        return [(f"{name}: {one.what}", _hits(one, mine), len(mine)) for one in self.counted]

    def _findings(self, name: str, rows: Sequence[Row]) -> list[Finding]:
        mine = [row for row in rows if row["of"] == name]
        stands = name == next(iter(self.variants))
        found = [_count(f"{name}: {one.what}", one, mine, stands) for one in self.counted]
        left = sum(not row["finished"] for row in mine)
        note = f"{left} of {len(mine)} trials unfinished" if left else ""
        means = ((f"{name}: {what}", [row[column] for row in mine]) for what, column in MEANS)
        return [*found, *(mean_finding(what, values, note) for what, values in means)]


MEANS = (("unsafe moves while parented", "deaths"), ("guidance queries", "guidance"), ("ticks", "ticks"))


def _count(what: str, one: Counted, rows: Sequence[Row], stands: bool) -> Finding:
    return count_finding(what, one.paper if stands else SILENT, _hits(one, rows), len(rows))


def _hits(one: Counted, rows: Sequence[Row]) -> int:
    return sum(row[one.column] in one.words for row in rows)

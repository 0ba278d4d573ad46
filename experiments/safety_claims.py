"""Safety claims with exact counts: what the argmax policies of many trials do after 50 queries (Sec. 3.2).

Each claim is tested in variants: with the paper's defaults and with the conservative preset, with and without
pre-training, and with repeated queries, as the paper is written. The initial policies are counted as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from parenting.agent.config import PRESETS, Config
from parenting.envs import registry
from parenting.experiments.reporting.comparison import (
    NEVER,
    NONE_OF_100,
    SILENT,
    Comparison,
    compare_count,
    compare_mean,
)
from parenting.experiments.reporting.plots import Proportion, plot_proportions
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Request, Results, chunk_ranges

QUERIES, MAX_TICKS = 50, 5_000
PRETRAINED = "before any query, pre-trained"
UNTRAINED = "before any query, not pre-trained"
MEANS = (("unsafe moves during parenting", "deaths"), ("ticks", "ticks"))


class Variant(NamedTuple):
    """Settings of an arm: a preset, and changes to it and to the world's own settings."""

    preset: str
    changes: Mapping[str, Any]
    share: float = 1.0  # of work, for a trial, against the others


VARIANTS: dict[str, Variant] = {
    "defaults": Variant("lax", {}, 3.0),
    "defaults, comparing twice": Variant("lax", {"recompare": True}, 2.0),
    "conservative": Variant("conservative", {}),
    "conservative, not pre-trained": Variant("conservative", {"pretrain": False}, 0.3),
}
"""By their names in trials.csv. Only the first, with the paper's settings, is compared with the paper."""


class Count(NamedTuple):
    """One count: outcomes in one deployment, and the paper's, as `compare_count` has it."""

    what: str
    words: tuple[str, ...]
    column: str = "outcome"
    paper: str = SILENT


class Claim(NamedTuple):
    """A world, what is counted there, and what else is tried than VARIANTS."""

    world: str
    level: str
    counted: Sequence[Count]
    prose: str  # the template of the page
    more: Mapping[str, Variant] = {}

    @property
    def variants(self) -> dict[str, Variant]:
        """All, by name."""
        return {**VARIANTS, **self.more}

    def config(self, request: Request) -> Mapping[str, Any]:
        """Return all that the results depend on."""
        return {
            "world": self.world,
            "level": self.level,
            "queries": QUERIES,
            "max_ticks": MAX_TICKS,
            "variants": {name: [of.preset, dict(of.changes)] for name, of in self.variants.items()},
        }

    def tasks(self, request: Request) -> list[Task]:
        """The trials of every variant; and policies as they are born, which no tick follows."""
        conservative, fresh = VARIANTS["conservative"], VARIANTS["conservative, not pre-trained"]
        every = chunk_ranges(request.trials)
        return [
            self._task(PRETRAINED, conservative, range(1), request.seed, ticks=0),
            *(self._task(UNTRAINED, fresh, span, request.seed, ticks=0) for span in every),
            *(
                self._task(name, self.variants[name], span, request.seed)
                for name in self.tried(request)
                for span in every
            ),
        ]

    def tried(self, request: Request) -> list[str]:
        """All variants; at the quick scale the paper's."""
        return list(self.variants)[: 1 if request.scale == "quick" else None]

    def _task(self, label: str, of: Variant, span: range, seed: int, ticks: int = MAX_TICKS) -> Task:
        key = f"{label.replace(', ', '-').replace(' ', '-')}-{span.start:06d}-{span.stop:06d}"
        mine = {
            "label": label,
            "world": self.world,
            "level": self.level,
            "preset": of.preset,
            "changes": dict(of.changes),
            "until": ("queries", QUERIES),
            "max_ticks": ticks,
            "span": (span.start, span.stop),
            "seed": seed,
        }
        share = of.share * len(span) if ticks else 0.1
        return Task(key, "parenting.experiments.training.tasks:parent_trials", mine, share)

    def report(self, request: Request, rows: Sequence[Row]) -> Results:
        """Counts and means of every variant, and of policies as they are born."""
        names = self.tried(request)
        found = [one for name in names for one in self._findings(name, _of(name, rows))]
        counts = [one for name in [*names, UNTRAINED] for one in self._proportions(name, _of(name, rows))]
        words = paragraphs(
            self.prose, presets=PRESETS, entropy=Config().lambda_global, queries=QUERIES, max_ticks=MAX_TICKS
        )
        return Results(
            [*found, *self._initial(rows)], words, {"shares": lambda figure: plot_proportions(figure, counts)}
        )

    def _findings(self, name: str, mine: Sequence[Row]) -> Iterator[Comparison]:
        done = [row for row in mine if row["finished"]]
        left = f"{len(mine) - len(done)} of {len(mine)} trials unfinished" if len(done) < len(mine) else ""
        for one in self.counted:
            note = f"{left}, counted by their last policy" if left else ""
            yield _count(name, one, mine, self._paper(name, one), note)
        for what, column in MEANS:
            note = f"{left}, excluded from the mean" if left else ""
            yield compare_mean(f"{_shown(name)}: {what}", [row[column] for row in done], note)

    def _initial(self, rows: Sequence[Row]) -> Iterator[Comparison]:
        """The outcome of the one pre-trained policy, and how many of the untrained ones are unsafe."""
        (only,) = _of(PRETRAINED, rows)
        note = "one policy: all trials start from the same weights"
        for column in dict.fromkeys(one.column for one in self.counted):
            where = " ".join(column.split("_")[1:])
            what = f"{PRETRAINED}: what the argmax policy does" + (f", {where}" if where else "")
            yield Comparison(what, SILENT, only[column], note=note, reference=None)
        for one in self._unsafe:
            yield _count(UNTRAINED, one, _of(UNTRAINED, rows), SILENT)

    def _proportions(self, name: str, mine: Sequence[Row]) -> Iterator[Proportion]:
        for one in self._unsafe if name == UNTRAINED else self.counted:
            paper = self._paper(name, one)
            share = 0.0 if paper in (NEVER, NONE_OF_100) else None
            yield Proportion(_shown(name), one.what, _hits(one, mine), len(mine), share)

    @property
    def _unsafe(self) -> list[Count]:
        harm = registry.spec(self.world).harm
        return [one for one in self.counted if harm in one.words]

    def _paper(self, name: str, one: Count) -> str:
        """The paper's count; only the first variant is compared with it."""
        return one.paper if name == next(iter(VARIANTS)) else SILENT


def _shown(name: str) -> str:
    """A variant's name on the page."""
    return name.replace("comparing twice", "repeated queries")


def _of(name: str, rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["of"] == name]


def _count(name: str, one: Count, rows: Sequence[Row], paper: str, note: str = "") -> Comparison:
    return compare_count(f"{_shown(name)}: {one.what}", paper, _hits(one, rows), len(rows), note)


def _hits(one: Count, rows: Sequence[Row]) -> int:
    return sum(row[one.column] in one.words for row in rows)

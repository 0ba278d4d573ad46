"""Safety claims with exact counts: what the argmax policies of many trials do after 50 queries (Sec. 3.2).

A claim is tried in variants: with the paper's defaults and with the conservative preset, pre-trained or not,
and with the paper's letter on comparing twice. What policies do before any query stands beside them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from parenting.agent.config import PRESETS, Config
from parenting.envs import registry
from parenting.experiments.reporting.comparison import NEVER, SILENT, Comparison, compare_count, compare_mean
from parenting.experiments.reporting.plots import Proportion, plot_proportions
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Request, Results, chunk_ranges

QUERIES, MAX_TICKS = 50, 5_000
BORN = "before any query, pre-trained"
FRESH = "before any query, not pre-trained"
MEANS = (("unsafe moves while parented", "deaths"), ("ticks", "ticks"))


class Variant(NamedTuple):
    """How agents are raised: a preset, and changes to it and to the world's own settings."""

    preset: str
    changes: Mapping[str, Any]
    share: float = 1.0  # of work, for a trial, against the others


VARIANTS: dict[str, Variant] = {
    "defaults": Variant("lax", {}, 3.0),
    "defaults, comparing twice": Variant("lax", {"recompare": True}, 2.0),
    "conservative": Variant("conservative", {}),
    "conservative, not pre-trained": Variant("conservative", {"pretrain": False}, 0.3),
}
"""By name; the first is the paper's, and is what we hold against it."""


class Counted(NamedTuple):
    """One count: outcomes in one deployment, and the paper's, as `compare_count` has it."""

    what: str
    words: tuple[str, ...]
    column: str = "outcome"
    paper: int | str = SILENT


class Claim(NamedTuple):
    """A world, what is counted there, and what else is tried than VARIANTS."""

    world: str
    level: str
    counted: Sequence[Counted]
    words: Sequence[str]
    more: Mapping[str, Variant] = {}

    @property
    def variants(self) -> dict[str, Variant]:
        """All, by name."""
        return {**VARIANTS, **self.more}

    def config(self, request: Request) -> Mapping[str, Any]:
        """All that the pieces depend on."""
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
            self._task(BORN, conservative, range(1), request.seed, ticks=0),
            *(self._task(FRESH, fresh, span, request.seed, ticks=0) for span in every),
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
        counts = [one for name in [*names, FRESH] for one in self._shares(name, _of(name, rows))]
        words = [*self.words, *WORDS]
        return Results(
            [*found, *self._born(rows)], words, {"shares": lambda figure: plot_proportions(figure, counts)}
        )

    def _findings(self, name: str, mine: Sequence[Row]) -> Iterator[Comparison]:
        done = [row for row in mine if row["finished"]]
        left = f"{len(mine) - len(done)} of {len(mine)} trials unfinished" if len(done) < len(mine) else ""
        for one in self.counted:
            note = f"{left}, counted as they ended" if left else ""
            yield _count(name, one, mine, self._paper(name, one), note)
        for what, column in MEANS:
            note = f"{left}, not in the mean" if left else ""
            yield compare_mean(f"{name}: {what}", [row[column] for row in done], note)

    def _born(self, rows: Sequence[Row]) -> Iterator[Comparison]:
        """What the one pre-trained policy does, and how many of the fresh ones do harm."""
        (only,) = _of(BORN, rows)
        note = "one policy: all begin with the same weights"
        for column in dict.fromkeys(one.column for one in self.counted):
            where = " ".join(column.split("_")[1:])
            what = f"{BORN}: what the argmax policy does" + (f", {where}" if where else "")
            yield Comparison(what, SILENT, only[column], note=note)
        for one in self._harmful:
            yield _count(FRESH, one, _of(FRESH, rows), SILENT)

    def _shares(self, name: str, mine: Sequence[Row]) -> Iterator[Proportion]:
        for one in self._harmful if name == FRESH else self.counted:
            paper = self._paper(name, one)
            share = 0.0 if paper == NEVER else None if isinstance(paper, str) else paper / 100
            yield Proportion(name, one.what, _hits(one, mine), len(mine), share)

    @property
    def _harmful(self) -> list[Counted]:
        harm = registry.spec(self.world).harm
        return [one for one in self.counted if harm in one.words]

    def _paper(self, name: str, one: Counted) -> int | str:
        """The paper's count, of what we hold against it."""
        return one.paper if name == next(iter(VARIANTS)) else SILENT


def _of(name: str, rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["of"] == name]


def _count(name: str, one: Counted, rows: Sequence[Row], paper: int | str, note: str = "") -> Comparison:
    return compare_count(f"{name}: {one.what}", paper, _hits(one, rows), len(rows), note)


def _hits(one: Counted, rows: Sequence[Row]) -> int:
    return sum(row[one.column] in one.words for row in rows)


def _chances(preset: str) -> str:
    return ", ".join(map(str, PRESETS[preset].values()))


WORDS = (
    "*Defaults* are the paper's settings where it notes no others (Sec. 3.1.2), the *lax* ones of Table 1. "
    "Only their rows are held against it. Their numbers are lost in our copy. Ours are "
    f"{_chances('lax')} for `p_guid`, `p_rec` and `p_pref`, and {Config().lambda_global} for the weights of "
    f"entropy where nothing else is said. *Conservative* ({_chances('conservative')}) asks more often.",
    "Agents begin pre-trained except where a row says otherwise. *Comparing twice* is the paper's letter; "
    "without it, which is our rule, no pair is asked about again (docs/paper.md, Recorder and pairs). "
    f"Trials end after {QUERIES} answered queries, and are given up after {MAX_TICKS} ticks.",
)

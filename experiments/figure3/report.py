"""What the rows of Figure 3 say: which curve needs fewer queries, and what the paper's number would take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import inf
from statistics import fmean, median
from typing import NamedTuple

from parenting.experiments.figure3.tasks import BATCH
from parenting.experiments.reporting.comparison import LOST, SILENT, Comparison, mean_sd
from parenting.experiments.reporting.statistics import (
    auc_interval,
    effective_sample_size,
    mann_whitney_auc,
    median_interval,
)
from parenting.experiments.runner.store import Row
from parenting.experiments.spec import CHUNK

GOAL = 10_000
"""The paper's trials of a curve."""
CORES, GPU = 100, 50
"""A cluster's cores; and what we suppose one GPU to be worth in cores, since none was there to try it."""
TWICE = ", comparing twice"


def findings(taught: Mapping[str, int], whole: str, rows: Sequence[Row], device: str) -> list[Comparison]:
    """Of all curves: their queries, whether each needs fewer than those before, and what they cost.

    `taught` says in how many levels the agents of each curve were pre-parented. The curves come in the
    order in which they are to need fewer queries; `whole` is one beside them, never compared twice.
    """
    found = _of_levels(rows)
    names = [name for name in taught if name != whole]
    for twice in (False, True):
        mine = {name: _curve(name, worlds, twice, rows) for name, worlds in taught.items()}
        found += [_queries(mine[name]) for name in names]
        pairs = [*pairwise(names), (names[1], names[-1])]
        if not twice:
            found.append(_queries(mine[whole]))
            pairs.append((names[1], whole))
        found += [_fewer(mine[later], mine[earlier]) for earlier, later in pairs]
    found += _before([row for row in rows if row["of"] == "pre-parented"])
    return found + _projected(rows, device)


class Of(NamedTuple):
    """One curve, with or without comparing twice."""

    name: str
    trials: Sequence[Row]
    taught: int  # agents that it goes on from
    raw: int  # those of them that were not optimal in all their levels when they were given up

    @property
    def queries(self) -> list[float]:
        """Of every trial; an unfinished one needs more than any."""
        return [row["queries"] if row["finished"] else inf for row in self.trials]

    @property
    def worth(self) -> float:
        """How many independent trials these are."""
        return effective_sample_size(self.queries, [row["agent"] for row in self.trials])

    @property
    def premise(self) -> str:
        """What is wrong with the agents that it goes on from; nothing, if they are what they should be."""
        return f"given up: {self.raw} of its {self.taught} pre-parented agents" if self.raw else ""


def _curve(name: str, worlds: int, twice: bool, rows: Sequence[Row]) -> Of:
    agents = [row for row in rows if row["of"] == "pre-parented" and row["recompare"] == twice]
    mine = [row for row in agents if row["worlds"] == worlds]
    raw = sum(not row["finished"] for row in mine)
    return Of(f"{name}{TWICE * twice}", trials_of(name, twice, rows), len(mine), raw)


def trials_of(name: str, twice: bool, rows: Sequence[Row]) -> list[Row]:
    """The rows of one curve."""
    mine = [row for row in rows if row["of"] == "parented" and row["curve"] == name]
    return [row for row in mine if row["recompare"] == twice]


def _of_levels(rows: Sequence[Row]) -> list[Comparison]:
    levels = [row for row in rows if row["of"] == "level"]
    drawn, harm = max(row["drawn"] for row in levels), sum(row["outcome"] == "stuck" for row in levels)
    tempting = sum(row["tempts"] for row in levels)
    return [
        Comparison(
            "levels", "50" if len(levels) == 50 else SILENT, f"{len(levels)}", note=f"of {drawn} drawn"
        ),
        Comparison("dropped: the pre-trained agent solves them", SILENT, f"{drawn - len(levels)} of {drawn}"),
        Comparison("levels that tempt: the shortest way is unsafe", SILENT, f"{tempting} of {len(levels)}"),
        Comparison(
            "levels where the pre-trained policy leaves the box stuck", SILENT, f"{harm} of {len(levels)}"
        ),
    ]


def _queries(one: Of) -> Comparison:
    done = [row["queries"] for row in one.trials if row["finished"]]
    left = len(one.trials) - len(done)
    notes = [
        f"{left} of {len(one.trials)} unfinished" if left else f"mean {mean_sd(done)}",
        f"{fmean(row['deaths'] for row in one.trials):.2f} unsafe moves",
        one.premise,
    ]
    low, high = median_interval(one.queries, one.worth)
    return Comparison(
        what=f"queries at the median, {one.name}",
        paper=LOST,
        ours=_number(median(one.queries)),
        interval=f"{_number(low)} to {_number(high)}",
        note="; ".join(filter(None, notes)),
    )


def _number(queries: float) -> str:
    return f"{queries:g}" if queries < inf else "not reached"


def _fewer(later: Of, earlier: Of) -> Comparison:
    share = mann_whitney_auc(later.queries, earlier.queries)
    low, high = auc_interval(share, later.worth, earlier.worth)
    apart = not low <= 0.5 <= high
    premise = later.premise or earlier.premise
    return Comparison(
        what=f"{later.name} needs fewer queries than {earlier.name.removesuffix(TWICE)}",
        paper="yes",
        ours=f"in {100 * share:.0f} % of pairs of trials",
        interval=f"{100 * low:.0f} to {100 * high:.0f} %",
        agrees=share > 0.5 if apart and not premise else None,
        note=premise or ("" if apart else "these trials do not tell them apart"),
    )


def _before(rows: Sequence[Row]) -> list[Comparison]:
    """What pre-parenting itself took; its queries are in no curve."""
    found = []
    for worlds, twice in dict.fromkeys((row["worlds"], row["recompare"]) for row in rows):
        agents = [row for row in rows if (row["worlds"], row["recompare"]) == (worlds, twice)]
        done = [row["queries"] for row in agents if row["finished"]]
        found.append(
            Comparison(
                what=f"queries of pre-parenting, N = {worlds}{TWICE * twice}",
                paper=SILENT,
                ours=mean_sd(done),
                note=f"{len(agents) - len(done)} of {len(agents)} agents unfinished",
            )
        )
    return found


def _projected(rows: Sequence[Row], device: str) -> list[Comparison]:
    """The paper's number of trials, of every curve that was run, by the seconds that these took."""
    groups: dict[tuple[str, bool], list[float]] = {}
    for row in rows:
        if row["of"] == "parented":
            groups.setdefault((row["curve"], row["recompare"]), []).append(row["seconds"])
    before = [row["seconds"] for row in rows if row["of"] == "pre-parented"]
    all_of_it = sum(before) + GOAL * sum(map(fmean, groups.values()))
    longest = BATCH * max(before) + CHUNK * max(map(fmean, groups.values()))  # these wait for each other
    what = f"{GOAL} trials of each of the {len(groups)} curves would take"
    if device != "cpu":
        return [Comparison(f"{what}, on this GPU", SILENT, duration(all_of_it))]
    supposed = f"none was there to try it; supposed: it does the work of {GPU} cores"
    return [
        Comparison(f"{what}, on two cores", SILENT, duration(all_of_it / 2)),
        Comparison(f"{what}, on {CORES} cores", SILENT, duration(longest + all_of_it / CORES)),
        Comparison(f"{what}, on one GPU", SILENT, duration(all_of_it / GPU), note=supposed),
    ]


def duration(seconds: float) -> str:
    """Seconds in words."""
    if seconds >= 7200:
        return f"{seconds / 3600:.0f} hours"
    return f"{seconds / 60:.0f} minutes" if seconds >= 120 else f"{seconds:.0f} seconds"

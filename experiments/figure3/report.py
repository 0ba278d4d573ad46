"""Figure 3's generalisation report: which curve needs fewer queries, and the cost of the paper's trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import inf
from statistics import fmean, median
from typing import NamedTuple

from parenting.evaluation.statistics import (
    auc_interval,
    mann_whitney_auc,
    median_interval,
)
from parenting.experiments.figure3.tasks import BATCH
from parenting.experiments.reporting.comparison import LOST, SILENT, Comparison, mean_sd
from parenting.experiments.runner.store import Row
from parenting.experiments.spec import CHUNK

GOAL = 10_000
"""The paper's trials of a curve."""
CORES, GPU = 100, 50
"""Cores of a cluster; and of a GPU, an assumption, because no GPU was available to measure it."""
REPEATED = ", repeated queries"


def findings(taught: Mapping[str, int], whole: str, rows: Sequence[Row], device: str) -> list[Comparison]:
    """Compare the curves: queries of each, which need fewer, and the cost of the paper's number of trials.

    Args:
        taught: The number of levels in which the agents of each curve were pre-parented, in the order in
            which the curves should need fewer queries.
        whole: The additional curve whose agents keep X; it has no repeated queries.
        rows: Rows of levels, pre-parented agents and trials.
        device: Device on which the trials were run.
    """
    found = _of_levels(rows)
    names = [name for name in taught if name != whole]
    for repeated in (False, True):
        mine = {name: _curve(name, worlds, repeated, rows) for name, worlds in taught.items()}
        found += [_queries(mine[name]) for name in names]
        pairs = [*pairwise(names), (names[1], names[-1])]
        if not repeated:
            found.append(_queries(mine[whole]))
            pairs.append((names[1], whole))
        found += [_compare(mine[later], mine[earlier]) for earlier, later in pairs]
    found += _pre_parenting([row for row in rows if row["of"] == "pre-parented"])
    return found + _projected_time(rows, device)


class CurveTrials(NamedTuple):
    """The trials of one curve, with or without repeated queries."""

    name: str
    trials: Sequence[Row]
    taught: int  # pre-parented agents from which its trials start
    unconverged: int  # those of them that were given up before they were optimal in all their levels

    @property
    def queries(self) -> list[float]:
        """Queries of every trial; infinite if it was not finished."""
        return [row["queries"] if row["finished"] else inf for row in self.trials]

    @property
    def agents(self) -> list[int | None]:
        """The pre-parented agent that each trial starts from, if any."""
        return [row.get("agent") for row in self.trials]

    @property
    def premise(self) -> str:
        """The reason why the curve is not the paper's; empty if its agents have all converged."""
        if not self.unconverged:
            return ""
        return f"{self.unconverged} of its {self.taught} pre-parented agents did not converge"


def _curve(name: str, worlds: int, repeated: bool, rows: Sequence[Row]) -> CurveTrials:
    agents = [row for row in rows if row["of"] == "pre-parented" and row["recompare"] == repeated]
    mine = [row for row in agents if row["worlds"] == worlds]
    unconverged = sum(not row["finished"] for row in mine)
    return CurveTrials(
        f"{shown(name)}{REPEATED * repeated}", trials_of(name, repeated, rows), len(mine), unconverged
    )


def shown(name: str) -> str:
    """The name of a curve on the page."""
    return name.replace("X and all taken along", "X kept")


def trials_of(name: str, repeated: bool, rows: Sequence[Row]) -> list[Row]:
    """The rows of one curve."""
    mine = [row for row in rows if row["of"] == "parented" and row["curve"] == name]
    return [row for row in mine if row["recompare"] == repeated]


def _of_levels(rows: Sequence[Row]) -> list[Comparison]:
    levels = [row for row in rows if row["of"] == "level"]
    drawn, harm = max(row["drawn"] for row in levels), sum(row["outcome"] == "stuck" for row in levels)
    tempting = sum(row["tempts"] for row in levels)
    return [
        _measured("levels, of which the paper has 50", f"{len(levels)}", f"of {drawn} drawn"),
        _measured("discarded: the pre-trained agent solves them", f"{drawn - len(levels)} of {drawn}"),
        _measured("levels whose shortest path is unsafe", f"{tempting} of {len(levels)}"),
        _measured("levels where the pre-trained policy leaves the box stuck", f"{harm} of {len(levels)}"),
    ]


def _measured(what: str, ours: str, note: str = "") -> Comparison:
    return Comparison(what, SILENT, ours, note=note, reference=None)


def _queries(one: CurveTrials) -> Comparison:
    done = [row["queries"] for row in one.trials if row["finished"]]
    left = len(one.trials) - len(done)
    notes = [
        f"{left} of {len(one.trials)} unfinished" if left else f"mean {mean_sd(done)}",
        f"{fmean(row['deaths'] for row in one.trials):.2f} unsafe moves a trial",
        one.premise,
    ]
    found = median_interval(one.queries, one.agents)
    return Comparison(
        what=f"median queries, {one.name}",
        paper=LOST,
        ours=_number(median(one.queries)),
        interval="" if found is None else f"{_number(found.low)} to {_number(found.high)}",
        note="; ".join(filter(None, notes)),
    )


def _number(queries: float) -> str:
    return f"{queries:g}" if queries < inf else "not reached"


def _compare(later: CurveTrials, earlier: CurveTrials) -> Comparison:
    share = mann_whitney_auc(later.queries, earlier.queries)
    found = auc_interval(later.queries, earlier.queries, later.agents, earlier.agents)
    fewer = found.above(0.5) if found else None
    premise = later.premise or earlier.premise
    return Comparison(
        what=f"{later.name} needs fewer queries than {earlier.name.removesuffix(REPEATED)}",
        paper="yes",
        ours=f"in {100 * share:.0f} % of pairs of trials",
        interval="" if found is None else f"{100 * found.low:.0f} to {100 * found.high:.0f} %",
        agrees=None if premise else fewer,
        note=premise,
    )


def _pre_parenting(rows: Sequence[Row]) -> list[Comparison]:
    """Queries of pre-parenting itself, which no curve includes."""
    found = []
    for worlds, repeated in dict.fromkeys((row["worlds"], row["recompare"]) for row in rows):
        agents = [row for row in rows if (row["worlds"], row["recompare"]) == (worlds, repeated)]
        done = [row["queries"] for row in agents if row["finished"]]
        found.append(
            Comparison(
                what=f"queries of pre-parenting, N = {worlds}{REPEATED * repeated}",
                paper=SILENT,
                ours=mean_sd(done),
                note=f"{len(agents) - len(done)} of {len(agents)} agents unfinished",
                reference=None,
            )
        )
    return found


def _projected_time(rows: Sequence[Row], device: str) -> list[Comparison]:
    """Time for the paper's number of trials of every curve, from the seconds of these trials."""
    groups: dict[tuple[str, bool], list[float]] = {}
    for row in rows:
        if row["of"] == "parented":
            groups.setdefault((row["curve"], row["recompare"]), []).append(row["seconds"])
    before = [row["seconds"] for row in rows if row["of"] == "pre-parented"]
    all_of_it = sum(before) + GOAL * sum(map(fmean, groups.values()))
    longest = BATCH * max(before) + CHUNK * max(map(fmean, groups.values()))  # one after the other
    what = f"{GOAL} trials of each of the {len(groups)} curves would take"
    if device != "cpu":
        return [_measured(f"{what}, on this GPU", duration(all_of_it))]
    supposed = f"assumed, not measured: a GPU does the work of {GPU} cores"
    return [
        _measured(f"{what}, on two cores", duration(all_of_it / 2)),
        _measured(f"{what}, on {CORES} cores", duration(longest + all_of_it / CORES)),
        _measured(f"{what}, on one GPU", duration(all_of_it / GPU), supposed),
    ]


def duration(seconds: float) -> str:
    """A duration in hours, minutes or seconds."""
    if seconds >= 7200:
        return f"{seconds / 3600:.0f} hours"
    return f"{seconds / 60:.0f} minutes" if seconds >= 120 else f"{seconds:.0f} seconds"

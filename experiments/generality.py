"""What the rows of Figure 3 say: which curve needs fewer queries, and what the paper's number would take."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf, sqrt
from statistics import fmean, median, stdev
from typing import TYPE_CHECKING

from experiments.experiment import CHUNK
from experiments.findings import SILENT, Finding, Z, spread
from experiments.generalising import TOGETHER
from experiments.pieces import Row
from experiments.ranks import fewer, independent, pairs_interval

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GOAL = 10_000
"""The paper's trials of a curve."""
CORES, GPU = 100, 50
"""A cluster's cores; and what we suppose one GPU to be worth in cores, since none was there to try it."""
COLOURS = ("#999999", "#0072b2", "#e69f00", "#009e73")
BINS = 40
TWICE = ", comparing twice"


def findings(names: Sequence[str], whole: str, rows: Sequence[Row], device: str) -> list[Finding]:
    """Of all curves: their queries, whether each needs fewer than the one before, and what they cost."""
    found = _of_levels(rows)
    for twice in (False, True):
        mine = {name: _trials(name, twice, rows) for name in names}
        found += [_queries(name, twice, trials) for name, trials in mine.items()]
        found += [_fewer(pair, twice, mine[pair[1]], mine[pair[0]]) for pair in pairwise(names)]
    found.append(_queries(whole, False, _trials(whole, False, rows)))
    found += _before([row for row in rows if row["of"] == "pre-parented"])
    return found + _projected(rows, device)


def _trials(name: str, twice: bool, rows: Sequence[Row]) -> list[Row]:
    mine = [row for row in rows if row["of"] == "parented" and row["curve"] == name]
    return [row for row in mine if row["recompare"] == twice]


def _of_levels(rows: Sequence[Row]) -> list[Finding]:
    levels = [row for row in rows if row["of"] == "level"]
    drawn, harm = max(row["drawn"] for row in levels), sum(row["outcome"] == "stuck" for row in levels)
    tempting = sum(row["tempts"] for row in levels)
    return [
        Finding("levels", "50" if len(levels) == 50 else SILENT, f"{len(levels)}", note=f"of {drawn} drawn"),
        Finding("dropped: the pre-trained agent solves them", SILENT, f"{drawn - len(levels)} of {drawn}"),
        Finding("levels that tempt: the shortest way is unsafe", SILENT, f"{tempting} of {len(levels)}"),
        Finding(
            "levels where the pre-trained policy leaves the box stuck", SILENT, f"{harm} of {len(levels)}"
        ),
    ]


def _queries(name: str, twice: bool, trials: Sequence[Row]) -> Finding:
    done = [row for row in trials if row["finished"]]
    queries = [row["queries"] for row in done]
    middle = median(_censored(trials))
    notes = [
        f"median {middle:g}" if middle < inf else "median: not reached",
        f"{len(trials) - len(done)} of {len(trials)} unfinished",
        f"{fmean(row['deaths'] for row in trials):.2f} unsafe moves",
    ]
    if len(queries) > 1:
        half = Z * stdev(queries) / sqrt(independent(*_by_agent(done)))
        interval = f"{fmean(queries) - half:.0f} to {fmean(queries) + half:.0f}"
    return Finding(
        what=f"queries, {name}{TWICE * twice}",
        paper=SILENT,
        ours=spread(queries),
        interval=interval if len(queries) > 1 else "",
        note="; ".join(notes),
    )


def _censored(trials: Sequence[Row]) -> list[float]:
    """Queries of every trial; an unfinished one needs more than any."""
    return [row["queries"] if row["finished"] else inf for row in trials]


def _by_agent(trials: Sequence[Row]) -> tuple[list[float], list[int | None]]:
    return _censored(trials), [row["agent"] for row in trials]


def _fewer(pair: tuple[str, str], twice: bool, later: Sequence[Row], earlier: Sequence[Row]) -> Finding:
    share = fewer(_censored(later), _censored(earlier))
    low, high = pairs_interval(share, independent(*_by_agent(later)), independent(*_by_agent(earlier)))
    agrees = None if low <= 0.5 <= high else share > 0.5
    return Finding(
        what=f"{pair[1]} needs fewer queries than {pair[0]}{TWICE * twice}",
        paper="yes",
        ours=f"in {100 * share:.0f} % of pairs of trials",
        interval=f"{100 * low:.0f} to {100 * high:.0f} %",
        agrees=agrees,
        note="these trials do not tell them apart" if agrees is None else "",
    )


def _before(rows: Sequence[Row]) -> list[Finding]:
    """What pre-parenting itself took; its queries are in no curve."""
    found = []
    for worlds, twice in dict.fromkeys((row["worlds"], row["recompare"]) for row in rows):
        agents = [row for row in rows if (row["worlds"], row["recompare"]) == (worlds, twice)]
        done = [row["queries"] for row in agents if row["finished"]]
        found.append(
            Finding(
                what=f"queries of pre-parenting, N = {worlds}{TWICE * twice}",
                paper=SILENT,
                ours=spread(done),
                note=f"{len(agents) - len(done)} of {len(agents)} agents unfinished",
            )
        )
    return found


def _projected(rows: Sequence[Row], device: str) -> list[Finding]:
    """The paper's number of trials, of every curve that was run, by the seconds that these took."""
    groups: dict[tuple[str, bool], list[float]] = {}
    for row in rows:
        if row["of"] == "parented":
            groups.setdefault((row["curve"], row["recompare"]), []).append(row["seconds"])
    before = [row["seconds"] for row in rows if row["of"] == "pre-parented"]
    all_of_it = sum(before) + GOAL * sum(map(fmean, groups.values()))
    longest = TOGETHER * max(before) + CHUNK * max(map(fmean, groups.values()))  # these wait for each other
    what = f"{GOAL} trials of each of the {len(groups)} curves would take"
    if device != "cpu":
        return [Finding(f"{what}, on this GPU", SILENT, duration(all_of_it))]
    supposed = f"none was there to try it; supposed: it does the work of {GPU} cores"
    return [
        Finding(f"{what}, on two cores", SILENT, duration(all_of_it / 2)),
        Finding(f"{what}, on {CORES} cores", SILENT, duration(longest + all_of_it / CORES)),
        Finding(f"{what}, on one GPU", SILENT, duration(all_of_it / GPU), note=supposed),
    ]


def duration(seconds: float) -> str:
    """Seconds in words."""
    if seconds >= 7200:
        return f"{seconds / 3600:.0f} hours"
    return f"{seconds / 60:.0f} minutes" if seconds >= 120 else f"{seconds:.0f} seconds"


def draw(figure: Figure, names: Sequence[str], rows: Sequence[Row]) -> None:
    """Four histograms, without comparing twice and with it; what is missing to 1 is unfinished."""
    panels = figure.subplots(2, 1, sharex=True)
    most = max((row["queries"] for row in rows if row["of"] == "parented" and row["finished"]), default=1)
    edges = [most * place / BINS for place in range(BINS + 1)]
    for axes, twice in zip(panels, (False, True), strict=True):
        for name, colour in zip(names, COLOURS, strict=True):
            trials = _trials(name, twice, rows)
            done = [row["queries"] for row in trials if row["finished"]]
            label = f"{name}: {len(done)} of {len(trials)} done"
            weights = [1 / len(trials)] * len(done)
            axes.hist(done, edges, weights=weights, histtype="step", color=colour, label=label)
        axes.set_title("comparing twice" if twice else "never comparing twice")
        axes.set_ylabel("share of trials")
        axes.legend(fontsize="small")
    panels[-1].set_xlabel("queries until optimal in all levels for parenting")

"""The page of an experiment: numbers by what they are compared with, figures, prose, and origin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from parenting.experiments.reporting.comparison import SILENT, Comparison, Reference, count_verdicts

RESULTS, TRIALS = "results.json", "trials.csv"
AGREES = {True: "yes", False: "**no**", None: "–"}
HEADINGS: dict[Reference | None, str] = {
    "paper": "Compared with the paper",
    "fit": "Tuned to the paper",
    "check": "Checks",
    None: "Also measured",
}
"""The tables of a page, in this order."""
SECOND: dict[Reference | None, str] = {"paper": "paper", "fit": "paper", "check": "expected"}
"""The heading of the second column of each; the last table has none."""
COUNTED: dict[Reference, str] = {
    "paper": "Of the rows compared with the paper",
    "fit": "Of those tuned to it",
    "check": "Of our own checks",
}


def page(results: dict[str, Any], figures: Sequence[str]) -> str:
    """The Markdown of a results.json."""
    rows, name = [Comparison(**found) for found in results["findings"]], results["name"]
    lines = [f"# {results['title']}", "", f"{_place(results['section'])}. {results['claim']}", ""]
    lines += [verdict_sentence(rows), ""]
    for figure in figures:
        lines += [f"![{results['title']}: {figure}]({name}/{figure}.svg)", ""]
    for reference, heading in HEADINGS.items():
        if mine := [row for row in rows if row.reference == reference]:
            lines += [f"## {heading}", "", *_table(mine, reference), ""]
    lines += ["## Notes", "", *(line for words in results["words"] for line in (words, ""))]
    return "\n".join([*lines, *_origin(results)]) + "\n"


def _place(section: str) -> str:
    return f"Sec. {section}" if section else "Beyond the paper"


def verdict_sentence(rows: Sequence[Comparison]) -> str:
    """The number of rows that agree, counted apart by what they are compared with."""
    counts = count_verdicts(rows)
    told = [_counted(COUNTED[one], counts[one]) for one in COUNTED if sum(counts[one].values())]
    return " ".join(told)


def _counted(whose: str, count: dict[str, int]) -> str:
    agree = f"{count['yes']} agree{'s' * (count['yes'] == 1)}"
    disagree = f"{count['no']} do{'es' * (count['no'] == 1)} not"
    return f"{whose}, {agree}, {disagree}, and {count['open']} allow{'s' * (count['open'] == 1)} no verdict."


def _table(rows: Sequence[Comparison], reference: Reference | None) -> Iterator[str]:
    compared = reference in SECOND
    heads = ["what", SECOND.get(reference, ""), "ours", "difference", "95 % confidence interval", "agrees"]
    shown = [head for head, keep in zip(heads, _columns(rows, compared), strict=True) if keep]
    yield f"| {' | '.join(shown)} |"
    yield "|" + "---|" * len(shown)
    for one in rows:
        what = f"{one.what} ({one.note})" if one.note else one.what
        cells = [what, one.paper, one.ours, one.difference, one.interval, AGREES[one.agrees]]
        kept = [cell for cell, keep in zip(cells, _columns(rows, compared), strict=True) if keep]
        yield f"| {' | '.join(kept)} |"


def _columns(rows: Sequence[Comparison], compared: bool) -> list[bool]:
    """Say for each of the six columns whether a table has it: an empty one is left out."""
    return [
        True,
        compared and any(row.paper != SILENT for row in rows),
        True,
        any(row.difference for row in rows),
        any(row.interval for row in rows),
        compared,
    ]


def _origin(results: dict[str, Any]) -> list[str]:
    """The command, and which program and machine made the trials and the page."""
    request, name = results["asked"], results["name"]
    took = f"{results['seconds']:.0f} s on {results['workers']} process" + "es" * (results["workers"] > 1)
    made = sorted(results["commits"])
    commits = f"trials of commit{'s' * (len(made) > 1)} {', '.join(made)}"
    tried = f"with a GPU available ({results['gpu']})" if results["gpu"] else "without a GPU in the machine"
    return [
        "## Reproduce",
        "",
        f"    {results['command']}",
        "",
        f"{request['trials']} trial{'s' * (request['trials'] > 1)}, seed {request['seed']}, {took}, "
        f"torch {results['versions'].get('torch', '?')}, {commits}, "
        f"page of {results['commit'] or 'unknown'}. "
        f"Every trial: [{TRIALS}]({name}/{TRIALS}); all numbers: [{RESULTS}]({name}/{RESULTS}).",
        "",
        f"Run with `--device {request['device']}`, {tried}.",
    ]

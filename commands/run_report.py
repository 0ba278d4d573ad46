"""The results of `parenting run` for the reader, in plain words."""

from __future__ import annotations

from typing import Any

from parenting._plural import counted
from parenting.commands.run_store import stored

COUNTS = ("deaths", "guidance", "preference", "ticks")
WORDS = {
    "optimal": "optimal",
    "detour": "to the goal by a detour",
    "time": "out of time",
    "circle": "in a circle",
    "wall": "into a wall without end",
}
"""Outcomes as a sentence goes on; a world's own word for harm stands as it is."""
BESIDE = ("stage", "queries", "trials", "goal")
"""Entries that are not outcomes; *goal* is a sum of two of them."""


def page(results: dict[str, Any]) -> str:
    """Format what `experiments.training.summary.summarise` returns, a line each."""
    number = len(results["trials"])
    lines = [
        f"{results['world']}, {results['level']}: {counted(number, 'trial')}"
        f" until {results['until']}, {results['seconds']} s"
    ]
    if "parent" in results:
        lines.append(_line("parent", results["parent"]))
    for part, one in results.get("origin", {}).items():
        lines.append(_line(f"from {part}", f"{one['file']} ({one['sha256'][:12]})"))
    if "waterings" not in results["evaluation"]:
        lines.append(_line("optimal", f"{sum(row['optimal'] for row in results['trials'])} of {number}"))
    lines += [_line(name, _spread(results["mean"][name], results["sd"][name])) for name in COUNTS]
    if results["unfinished"]:
        lines.append(_line("unfinished", _unfinished(results)))
    lines += _endings("at the end", results["evaluation"])
    for stage in results.get("stages", ()):
        lines += _stage(f"stage {stage['stage']}", stage)
    if "runs" in results:
        lines.append(stored(results["runs"]))
    return "\n".join(lines)


def _line(name: str, said: str) -> str:
    return f"  {name:<12}{said}" if len(name) < 12 else f"  {name} {said}"


def _spread(mean: float | None, sd: float | None) -> str:
    return "-" if mean is None else f"{mean:.2f}" + ("" if sd is None else f" +- {sd:.2f}")


def _unfinished(results: dict[str, Any]) -> str:
    stuck, rest = results["stuck"], results["unfinished"] - results["stuck"]
    said = [f"{stuck} with no acceptable action"] if stuck else []
    said += [f"{rest} after {counted(results['max_ticks'], 'tick')}"] if rest else []
    return f"{', '.join(said)}; not in the means"


def _stage(name: str, found: dict[str, Any]) -> list[str]:
    if found["queries"] is None:
        return [_line(name, "no trial came to it")]
    return _endings(name, found, f"; {_queries(found['queries'])}")


def _queries(mean: float) -> str:
    return "1 query" if f"{mean:.0f}" == "1" else f"{mean:.0f} queries"


def _endings(name: str, found: dict[str, Any], behind: str = "") -> list[str]:
    """Format the outcomes of the argmax policies: one line, or one for each deployment."""
    if "waterings" in found:
        return [_line(name, _watered(found) + behind)]
    if "optimal" in found:
        return [_line(name, _counted(found) + behind)]
    each = [(where, one) for where, one in found.items() if isinstance(one, dict)]
    return [_line(name, f"{where}: {_counted(one)}{behind}") for where, one in each]


def _watered(found: dict[str, Any]) -> str:
    end = "ends" if found["bucket"] == 1 else "end"
    return (
        f"{_spread(found['waterings'], found['sd'])} waterings in {counted(found['steps'], 'step')}"
        f" (the parent: {found['parent']:.2f}), {counted(found['bucket'], 'step')} {end} in the bucket"
    )


def _counted(found: dict[str, Any]) -> str:
    """Every outcome that there is, and the harm even where there is none."""
    outcomes = {name: number for name, number in found.items() if name not in BESIDE}
    said = {name: number for name, number in outcomes.items() if number or name not in WORDS}
    return ", ".join(f"{number} {WORDS.get(name, name)}" for name, number in said.items())

"""Counts for Sec. 4.1: agents whose stages have converged, and whose policy is greedy for V_T.

Many policies are greedy for V_T before stage T begins. They are counted apart, because they test less.
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

from parenting.evaluation.statistics import proportion_interval
from parenting.experiments.reporting.comparison import Comparison, format_percent, seldom_enough
from parenting.experiments.reporting.prose import paragraphs
from parenting.experiments.runner.store import Row
from parenting.experiments.value_iteration.converge import CONFIG, CONVERGING, STAGES


class Agents(NamedTuple):
    """Rows of one stage, of the agents that converged in it and in all earlier stages."""

    trained: list[Row]  # their policy was not yet greedy for V_T at the beginning of the stage
    already: list[Row]  # it was
    excluded: int  # agents that did not converge in this stage or an earlier one


def agents(worlds: Sequence[str], stage: int, rows: Sequence[Row]) -> Agents:
    """The agents of some worlds at a stage; Sec. 4.1 assumes that all stages so far have converged."""
    mine = [row for row in rows if row["of"] in worlds and row["stage"] <= stage]
    unconverged = {_agent(row) for row in mine if not row["converged"]}
    done = [row for row in mine if row["stage"] == stage and _agent(row) not in unconverged]
    trained = [row for row in done if row["greedy_before"] < row["states"]]
    already = [row for row in done if row["greedy_before"] == row["states"]]
    return Agents(trained, already, len(unconverged))


def _agent(row: Row) -> tuple[str, int, int]:
    return row["of"], row["trial"], row["level"]


def greedy_at_end(rows: Sequence[Row]) -> int:
    """The number of agents whose policy is greedy in every state at the end of the stage."""
    return sum(row["greedy"] == row["states"] for row in rows)


def findings(worlds: Sequence[str], rows: Sequence[Row]) -> list[Comparison]:
    """A row for each world and stage, and one for each stage in all worlds."""
    each = [finding(world, [world], stage, rows) for world in worlds for stage in range(1, STAGES + 1)]
    return [*each, *(finding("all worlds", worlds, stage, rows) for stage in range(1, STAGES + 1))]


def finding(name: str, worlds: Sequence[str], stage: int, rows: Sequence[Row]) -> Comparison:
    """Agents that a stage makes greedy for V_T.

    One agent that is not greedy, or no longer, refutes the claim. Without one, the trained agents support it
    as far as `seldom_enough` allows.
    """
    trained, already, excluded = agents(worlds, stage, rows)
    hits, kept = greedy_at_end(trained), greedy_at_end(already)
    missed = len(trained) - hits + len(already) - kept
    note = f"{len(already)} others were greedy from the beginning, and {kept} of them remained so"
    return Comparison(
        what=f"{name}: agents that stage {stage} makes greedy for V_{stage} in every state",
        paper="all",
        ours=f"{hits} of {len(trained)}",
        interval=format_percent(proportion_interval(hits, len(trained))) if trained else "",
        agrees=seldom_enough(missed, len(trained)),
        note=note + (f"; {excluded} did not converge" if excluded else ""),
    )


def words(rows: Sequence[Row]) -> list[str]:
    """The prose of the page, with the numbers of agents and states."""
    first = [row for row in rows if row["stage"] == 1]
    return paragraphs(
        "value_iteration/page.md",
        stages=STAGES,
        agents=len(first) // len({row["of"] for row in first}),
        states=[row["states"] for row in first],
        median=median,
        learning_rate=CONFIG.learning_rate,
        gradient_steps=CONVERGING,
    )

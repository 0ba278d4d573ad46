"""Sec. 4.1, counted: of the lives whose stages have converged, how many have a policy that is greedy for V_T.

Many a policy is greedy for V_T before stage T begins. Such lives are counted apart, since they test less.
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

from parenting.experiments.reporting.comparison import Comparison, proportion_interval
from parenting.experiments.runner.store import Row
from parenting.experiments.value_iteration.converge import CONFIG, CONVERGING, STAGES


class Lives(NamedTuple):
    """Rows of one stage, of the lives that converged in it and in all stages before."""

    taught: list[Row]  # the policy was not yet greedy for V_T when the stage began
    already: list[Row]  # it was
    left: int  # lives that did not converge, in this stage or before


def lives(kind: str, stage: int, rows: Sequence[Row]) -> Lives:
    """The lives of a world at a stage: Sec. 4.1 supposes that all stages so far have converged."""
    mine = [row for row in rows if row["of"] == kind and row["stage"] <= stage]
    astray = {_life(row) for row in mine if not row["converged"]}
    done = [row for row in mine if row["stage"] == stage and _life(row) not in astray]
    taught = [row for row in done if row["greedy_before"] < row["states"]]
    already = [row for row in done if row["greedy_before"] == row["states"]]
    return Lives(taught, already, len(astray))


def _life(row: Row) -> tuple[int, int]:
    return row["trial"], row["level"]


def _hits(rows: Sequence[Row]) -> int:
    return sum(row["greedy"] == row["states"] for row in rows)


def finding(kind: str, stage: int, rows: Sequence[Row]) -> Comparison:
    """Whether a stage made every policy greedy for V_T, and kept greedy those that were so before."""
    taught, already, left = lives(kind, stage, rows)
    hits, kept = _hits(taught), _hits(already)
    low, high = proportion_interval(hits, len(taught)) if taught else (0.0, 1.0)
    missed = hits < len(taught) or kept < len(already)
    note = f"{len(already)} others were so when it began, and {kept} stayed so"
    return Comparison(
        what=f"{kind}: lives that stage {stage} makes greedy for V_{stage} in every state",
        paper="all",
        ours=f"{hits} of {len(taught)}",
        interval=f"{100 * low:.1f} to {100 * high:.1f} %",
        agrees=not missed if taught or missed else None,
        note=note + (f"; {left} did not converge by then" if left else ""),
    )


def words(rows: Sequence[Row]) -> list[str]:
    """What a life is, how small its level is, how it converges, and what is counted."""
    first = [row for row in rows if row["stage"] == 1]
    each = len(first) // len({row["of"] for row in first})
    counts = [row["states"] for row in first]
    life = (
        f"A life is one agent on one random level, through {STAGES} stages, under a parent whose own policy "
        f"is random. A trial is several lives in each world: here {each} lives a world. Levels are small, so "
        f"that every state can be visited: {min(counts)} to {max(counts)} states in which an episode goes "
        f"on, {median(counts):g} in the median."
    )
    return [life, *WORDS]


WORDS = (
    "Clips begin in every state (exploring starts), and a stage ends when X compares the argmax with every "
    "other action in every state, and the policy agrees with all of X. That is the paper's premise of a "
    "converged stage; what is counted is its conclusion, in lives whose stages have all converged so far. "
    "There is no guidance and no entropy, every step begins a recording if none runs and tries a preference "
    f"query, Adam's step is {CONFIG.learning_rate:g}, and {CONVERGING} gradient steps are taken after every "
    "visit to all states, besides one in each tick. results.json has the whole config.",
    "pi_T begins as a copy of the policy before it, and is often greedy for V_T when its stage begins, the "
    "more so the later the stage. A row counts the lives in which there was something to learn; its note has "
    "the others.",
    "In the figure a hollow point is the share of all lives whose policy was greedy for V_T when stage T "
    "began, and a full one when it ended.",
)

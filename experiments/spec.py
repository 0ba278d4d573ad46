"""The parts of an experiment: settings, tasks, and a report on their rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from parenting.experiments.runner.store import Row, Task

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from parenting.experiments.reporting.comparison import Comparison

Scale = Literal["quick", "paper"]
Device = Literal["cpu", "cuda"]
CHUNK = 50
"""Trials of a task at most. It changes nothing but speed, and the last bits of sums."""


class Request(NamedTuple):
    """A request for an experiment."""

    trials: int
    seed: int = 0
    scale: Scale = "paper"
    device: Device = "cpu"


@dataclass(frozen=True)
class Results:
    """The report of an experiment: comparisons with the paper, prose and figures."""

    findings: Sequence[Comparison]
    words: Sequence[str]  # a paragraph each
    figures: Mapping[str, Callable[[Figure], None]] = field(default_factory=dict)  # file name -> drawing


@dataclass(frozen=True)
class Experiment:
    """A table, figure or claim of the paper, or beyond it. Its module, page and folder bear its name."""

    name: str
    title: str
    section: str  # of the paper; empty where the experiment goes beyond it
    claim: str  # what the paper says, or what is asked, in a sentence of ours
    trials: Mapping[Scale, int]
    config: Callable[[Request], Mapping[str, Any]]  # all that its results depend on besides the code
    tasks: Callable[[Request], Sequence[Task]]
    report: Callable[[Request, Sequence[Row]], Results]


def chunk_ranges(trials: int, chunk: int = CHUNK) -> list[range]:
    """The trials of every task. Those of fewer trials are the first of those of more."""
    return [range(first, min(first + chunk, trials)) for first in range(0, trials, chunk)]


def share_of(asked: int, part: int, of: int) -> int:
    """The trials of an arm with `part` trials where `of` are asked, if `asked` are.

    A part smaller than all grows by whole parts, so that its pieces stay pieces when more trials are asked.
    It is exact where fewer than `of` are asked.
    """
    return part * (asked // of) if part < of <= asked else -(-asked * part // of)

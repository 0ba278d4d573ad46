"""Settings of Figure 3: how many levels and agents there are, and the histograms (Sec. 3.4)."""

from __future__ import annotations

from typing import NamedTuple

from parenting.experiments.spec import Scale


class Size(NamedTuple):
    """Numbers of levels and of pre-parented agents, and the ticks after which a trial is given up."""

    parenting: int
    aside: int
    some: int
    many: int
    agents: int  # pre-parented for each N; the trials start from them in rotation
    max_ticks: int
    pre_ticks: int


SIZES: dict[Scale, Size] = {
    "paper": Size(10, 40, 20, 40, agents=5, max_ticks=2_500, pre_ticks=12_000),
    "quick": Size(2, 3, 1, 3, agents=2, max_ticks=300, pre_ticks=600),
}


class Curve(NamedTuple):
    """One histogram."""

    name: str
    key: str
    pretrain: bool
    worlds: int  # levels in which it was pre-parented before
    cost: float  # how much work a trial is, against the others; twice with `recompare`
    everything: bool = False  # what it takes along from there; else its policy alone


def curves(scale: Scale) -> tuple[Curve, ...]:
    """The four histograms, in the order in which they are to need fewer queries."""
    some, many = SIZES[scale].some, SIZES[scale].many
    return (
        Curve("no pre-training", "untrained", False, 0, 2.0),
        Curve("N = 0", "0", True, 0, 1.2),
        Curve(f"N = {some}", f"{some}", True, some, 1.2),
        Curve(f"N = {many}", f"{many}", True, many, 0.8),
    )


def whole(scale: Scale) -> Curve:
    """A fifth, which tells two readings of the paper apart."""
    some = SIZES[scale].some
    return Curve(f"N = {some}, X and all taken along", f"{some}-all", True, some, 3.0, everything=True)

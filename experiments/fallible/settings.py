"""Settings of the experiment on parents who err: its arms, and how many trials each has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from parenting.experiments.spec import Scale, share_of

TRIALS = 100
"""Trials asked at the paper's scale; shares are shares of them."""
TICKS = 400
"""A trial's ticks from the start, also after its policy is first optimal."""
ISLAND, BOTTLENECK = "island", "island-bottleneck"
PRESETS = ("conservative", "lax", "direct")
EPS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4)
FEW = (0.0, 0.1, 0.3)
"""Rates in the worlds other than Unsafe Exploration."""
BETA = (5, 10, 20)
LIKENESS = (0.1, 0.2, 0.4)
SLIPS = (0.1, 0.2)
"""Rates at which the ways to withstand errors are compared."""
THRICE = "best of three"


class Way(NamedTuple):
    """A way to withstand a parent's errors: a preset and its changes, or asking thrice."""

    preset: str = "conservative"
    changes: Mapping[str, Any] = {}
    work: float = 1.0  # of a trial, against the others
    thrice: bool = False  # every question is asked until two of at most three answers agree


TODAY, REPEATED, CONFIRM = "conservative", "repeated queries", "confirm 0.95"
FRUGAL, BOTH = "frugal", "frugal, confirm 0.95"
RELABEL, DOUBTED = "frugal, relabel", "frugal, confirm 0.95, relabel"
WAYS: Mapping[str, Way] = {
    TODAY: Way(),
    "lax": Way("lax"),
    "direct": Way("direct"),
    REPEATED: Way(changes={"repeat_queries": True}),
    "confirm 0.8": Way(changes={"confirm": 0.8}),
    CONFIRM: Way(changes={"confirm": 0.95}),
    "confirm 0.99": Way(changes={"confirm": 0.99}),
    THRICE: Way(thrice=True),
    "fresh pairs": Way(changes={"fresh_pairs": True}),
    "9 steps": Way(changes={"gradient_steps": 9}, work=5.0),
    FRUGAL: Way("frugal", work=5.0),
    BOTH: Way("frugal", {"confirm": 0.95}, 5.0),
    RELABEL: Way("frugal", {"relabel": True}, 5.0),
    DOUBTED: Way("frugal", {"confirm": 0.95, "relabel": True}, 5.0),
}
"""By name. All but the first three are ways to withstand errors; those without a preset are conservative."""
ROBUST = (REPEATED, "confirm 0.8", CONFIRM, "confirm 0.99", THRICE, "fresh pairs", "9 steps", FRUGAL, BOTH)
RELABELLED = (RELABEL, DOUBTED)
"""Ways that ask again in later visits."""
AGAINST_MISCONCEPTIONS = (TODAY, CONFIRM, FRUGAL, BOTH)


class Place(NamedTuple):
    """A level, its world, changes to the world's settings, and the work of a trial against the island's."""

    world: str
    changes: Mapping[str, Any] = {}
    work: float = 1.0


FRESH_START = {"pretrain": False}
PLACES: Mapping[str, Place] = {
    ISLAND: Place("unsafe-exploration"),
    BOTTLENECK: Place("unsafe-exploration", work=1.8),
    "box": Place("side-effects", FRESH_START),
    "button": Place("interruptibility", FRESH_START),
    "supervisor": Place("absent-supervisor", FRESH_START, 1.5),
    "garden": Place("reward-hacking", {**FRESH_START, "max_episode_steps": 10}, 5.0),
}
"""By level. Nobody is pre-trained: it would hide what the parent teaches, and cost the most."""
ELSEWHERE = ("box", "button", "supervisor", "garden")


FRESH, FRESH_SEED = ", until optimal", 1
"""The end of the name of an arm with fresh trials, and what is added to the request's seed for these."""


class Arm(NamedTuple):
    """A level, an agent and a parent."""

    level: str
    way: str
    parent: str  # as `--parent` has it
    share: float = 1.0  # of the request's trials
    fresh: bool = False  # other trials than all others', until optimal

    @property
    def name(self) -> str:
        """As in trials.csv."""
        return f"{self.level}, {self.way}, {self.parent}{FRESH * self.fresh}"

    @property
    def changes(self) -> dict[str, Any]:
        """All that is set beside the preset."""
        return {**PLACES[self.level].changes, **WAYS[self.way].changes}

    @property
    def work(self) -> float:
        """The work of a trial, against one on the island."""
        return WAYS[self.way].work * PLACES[self.level].work

    @property
    def part(self) -> int:
        """The number of trials at the paper's scale."""
        return round(TRIALS * self.share)

    def trials(self, asked: int) -> int:
        """The number of trials where a request asks for so many."""
        return share_of(asked, self.part, TRIALS)


def noisy(eps: float) -> str:
    """The parent who is wrong with a chance, independently each time."""
    return f"noisy:{eps:g}" if eps else "scripted"


TRIPLE, DOUBLE, HALF, THIRD, QUARTER, FIFTH, TENTH, TWENTIETH = 3.0, 2.0, 0.5, 0.3, 0.25, 0.2, 0.1, 0.05
"""Shares of a request's trials: more for what the findings are about, fewer for what is slow."""

SHARES = {0.0: DOUBLE, 0.1: DOUBLE, 0.2: 1.0}


def _sweep() -> Iterator[Arm]:
    """Errors of a growing rate, with the presets of the paper."""
    yield from (Arm(ISLAND, TODAY, noisy(eps), SHARES.get(eps, HALF)) for eps in EPS)
    yield from (Arm(BOTTLENECK, TODAY, noisy(eps), HALF) for eps in EPS)
    for preset in PRESETS[1:]:
        yield from (Arm(ISLAND, preset, noisy(eps), FIFTH) for eps in EPS)
        yield from (Arm(BOTTLENECK, preset, noisy(eps), TENTH) for eps in EPS)
    for level in ELSEWHERE:
        for preset in PRESETS:
            share = TWENTIETH if level == "garden" else FIFTH if preset == TODAY else TENTH
            yield from (Arm(level, preset, noisy(eps), share) for eps in FEW)


def _kinds() -> Iterator[Arm]:
    """Errors that depend on what is asked: by advantage, and by likeness."""
    for kind, values in (("boltzmann", BETA), ("likeness", LIKENESS)):
        yield from (Arm(ISLAND, TODAY, f"{kind}:{value:g}", THIRD) for value in values)
        for preset in PRESETS[1:]:
            yield from (Arm(ISLAND, preset, f"{kind}:{value:g}", TENTH) for value in values)
        yield from (Arm(BOTTLENECK, TODAY, f"{kind}:{value:g}", TENTH) for value in values)


def _frontier() -> Iterator[Arm]:
    """Ways to withstand slips, and errors by likeness."""
    for way in ROBUST:
        slow = WAYS[way].work > 1
        most = {CONFIRM: DOUBLE, THRICE: 1, "9 steps": QUARTER}
        yield Arm(ISLAND, way, noisy(0.1), most.get(way, HALF))
        yield Arm(ISLAND, way, noisy(0.2), QUARTER if slow else HALF)
        yield Arm(BOTTLENECK, way, noisy(0.1), HALF if way in (REPEATED, CONFIRM, THRICE) else QUARTER)
        yield Arm(BOTTLENECK, way, noisy(0.2), TENTH if slow else QUARTER)
    yield from (Arm(ISLAND, CONFIRM, f"likeness:{eps:g}", HALF) for eps in SLIPS)


def _misconceptions() -> Iterator[Arm]:
    """Errors that are the same each time."""
    for way in AGAINST_MISCONCEPTIONS:
        yield Arm(ISLAND, way, "misconceived:0.1", FIFTH if WAYS[way].work > 1 else HALF)


def _relabelled() -> Iterator[Arm]:
    """Answers that are doubted in later visits."""
    yield from (Arm(level, way, noisy(0.1)) for level in (ISLAND, BOTTLENECK) for way in RELABELLED)


CONFIRMED = (TODAY, CONFIRM, BOTH, DOUBTED)


def _confirmed() -> Iterator[Arm]:
    """The ways that a screening of twenty on one seed had picked, on fresh trials."""
    for level in (ISLAND, BOTTLENECK):
        yield from (Arm(level, way, noisy(0.1), TRIPLE, fresh=True) for way in CONFIRMED)


EVERY = (*_sweep(), *_kinds(), *_frontier(), *_misconceptions(), *_relabelled(), *_confirmed())
ARMS: Mapping[str, Arm] = {arm.name: arm for arm in EVERY}
QUICK = tuple(
    Arm(ISLAND, *rest).name for rest in ((TODAY, "scripted"), (TODAY, "noisy:0.1"), (CONFIRM, "noisy:0.1"))
)
QUICK_TICKS = 60


def tried(scale: Scale) -> dict[str, Arm]:
    """The arms of a scale, by name."""
    return {name: arm for name, arm in ARMS.items() if scale == "paper" or name in QUICK}


def ticks(scale: Scale) -> int:
    """The ticks of a trial."""
    return TICKS if scale == "paper" else QUICK_TICKS

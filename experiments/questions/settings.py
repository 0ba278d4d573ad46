"""Settings of the experiment on questions: its arms, and the goals of its verdicts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from parenting.experiments.spec import Scale, share_of

TRIALS = 300
"""Trials asked at the paper's scale."""
ANSWERS = 60
"""Answers up to which the areas go."""
MARKS = (*range(20), *range(20, ANSWERS + 1, 4))
"""Numbers of answers at which the curves are kept."""
WINDOW = 100
"""Ticks of a window of a long life."""
MAX_TICKS = 400
"""Ticks after which a trial is left unfinished."""
SILENT_TICKS = 100
"""Ticks of an agent that never asks."""

WORLD = "unsafe-exploration"


class RandomIslands(NamedTuple):
    """Random levels of one size on which settings are chosen; trial i lives on level i, counted on and on."""

    number: int
    height: int
    width: int
    seed: int


RANDOM = "20 random islands"
ISLANDS = {RANDOM: RandomIslands(20, 6, 8, 0)}
"""Names of sets of levels."""
STARTS = {"island": RandomIslands(20, 6, 8, 1), "island-bottleneck": RandomIslands(20, 7, 9, 1)}
"""Random islands of the size of a built-in level, on which agents are raised before they come to it."""
START_AGENTS = 5
"""Agents that are raised on them; trial i begins with the policy of agent i, counted on and on."""
START_TICKS: dict[Scale, int] = {"quick": 50, "paper": 500}
"""Ticks of these agents."""
MAZE_STEPS: dict[Scale, int] = {"quick": 20, "paper": 1600}
"""Steps of pre-training on mazes (Sec. 3.1.4), each of 16 episodes."""


class Arm(NamedTuple):
    """Settings with which agents are raised until optimal."""

    preset: str
    changes: Mapping[str, Any] = {}
    share: float | None = None  # ask in this share of steps, at random
    max_ticks: int = MAX_TICKS
    parent: str = "scripted"
    one_of: int = 3  # of so many trials one is raised
    cost: float = 1.0  # of a trial, against the others
    start: str | None = None  # the kind of agent whose policy the trials begin with


PRESETS = {
    "frugal": Arm("frugal", one_of=1, cost=1.5),
    "conservative": Arm("conservative", one_of=1),
    "lax": Arm("lax", one_of=6),
    "direct": Arm("direct", one_of=6),
}
"""The presets, as they stand in `agent.config`."""
ABLATIONS = {
    "frugal, 1 gradient step": Arm("frugal", {"gradient_steps": 1}, one_of=6),
    "frugal, 3 gradient steps": Arm("frugal", {"gradient_steps": 3}, one_of=6),
    "frugal, drawn pairs": Arm("frugal", {"fresh_pairs": False}, one_of=6),
    "frugal, no reuse": Arm("frugal", {"reuse_answers": False}, one_of=6),
    "frugal, refusals forgotten": Arm("frugal", {"learn_refusals": False}, one_of=6),
    "frugal, p_guid 0.95": Arm("frugal", {"p_guid": 0.95}, one_of=6),
    "frugal, late steps": Arm("frugal", {"late_steps": True}, one_of=6),
    "conservative, 9 gradient steps": Arm("conservative", {"gradient_steps": 9}, one_of=6),
}
"""The preset with one setting changed."""
CHOICE = f"{RANDOM}, for the choice"
"""The same random islands, and other agents than those whose results are reported."""
CHOICE_SEED = 2
"""Added to the request's seed for these agents."""
CHOICE_TRIALS = 40
"""Of each arm, however many are asked: two on each island."""
CHOSEN = f"frugal, {CHOICE}"
TRIED = {
    name: Arm("frugal", changes)
    for name, changes in {
        "1 gradient step": {"gradient_steps": 1},
        "3 gradient steps": {"gradient_steps": 3},
        "18 gradient steps": {"gradient_steps": 18},
        "late steps": {"late_steps": True},
        "drawn pairs": {"fresh_pairs": False},
        "no reuse": {"reuse_answers": False},
        "refusals forgotten": {"learn_refusals": False},
        "p_guid 0.95": {"p_guid": 0.95},
    }.items()
}
"""Other values of the preset's settings, one at a time."""
CHOICES: dict[str, tuple[str, str, Arm]] = {CHOSEN: (WORLD, RANDOM, Arm("frugal"))}
CHOICES |= {f"frugal, {name}, {CHOICE}": (WORLD, RANDOM, arm) for name, arm in TRIED.items()}
"""World, level and arm of the agents by which the settings are chosen; their costs are each other's."""
BASELINES = {
    "always ask": Arm("conservative", {"p_guid": 1.0}, one_of=6),
    "never": Arm("direct", {"p_rec": 0.0, "p_pref": 0.0}, max_ticks=SILENT_TICKS, one_of=6),
    "random": Arm("conservative", {"p_rec": 0.0, "p_pref": 0.0}, share=0.5, one_of=6),
}
"""Agents that ask in every step, in none, and in every second one, by a coin."""
ERRING = {
    "frugal, noisy:0.1": Arm("frugal", parent="noisy:0.1", one_of=6),
    "frugal, confirm 0.95, noisy:0.1": Arm("frugal", {"confirm": 0.95}, parent="noisy:0.1", one_of=6),
}
"""Parents who err."""
PARENTED, MAZES = "pre-parented", "pre-trained"
STARTED = {
    "frugal, pre-parented": Arm("frugal", start=PARENTED),
    "frugal, pre-trained": Arm("frugal", one_of=3, start=MAZES),
}
"""Agents that begin with a policy from random islands, or from mazes."""

ISLAND, BOTTLENECK = "island", "island-bottleneck"
ARMS: dict[str, tuple[str, str, Arm]] = {
    f"{name}, {level}": (WORLD, level, arm)
    for level in (ISLAND, BOTTLENECK)
    for name, arm in {**PRESETS, **STARTED}.items()
}
ARMS |= {
    f"{name}, {ISLAND}": (WORLD, ISLAND, arm) for name, arm in {**ABLATIONS, **BASELINES, **ERRING}.items()
}
"""World, level and arm by the name of its rows."""
ARMS |= {f"{name}, {RANDOM}": (WORLD, RANDOM, PRESETS[name]) for name in ("frugal", "conservative")}
SHARED = {
    name: ISLANDS[level].number if level in ISLANDS else START_AGENTS if arm.start == PARENTED else 1
    for name, (_, level, arm) in ARMS.items()
    if level in ISLANDS or arm.start is not None
}
"""Arms whose trials share levels or first policies in rotation, and how many there are of these: that many
trials are independent, as far as an interval is concerned."""
SHARED |= dict.fromkeys(CHOICES, ISLANDS[RANDOM].number)
OTHER_WORLDS = (
    ("side-effects", "box"),
    ("interruptibility", "button"),
    ("absent-supervisor", "supervisor"),
)
"""Worlds with a goal, pre-trained on mazes as everywhere in the paper (Sec. 3.1.4)."""
LEVELS = ((WORLD, ISLAND), (WORLD, BOTTLENECK), *OTHER_WORLDS)
"""World and name of the built-in levels with a goal."""
ARMS |= {
    f"{name}, {level}": (world, level, PRESETS[name]._replace(one_of=10, cost=8.0))
    for world, level in OTHER_WORLDS
    for name in ("frugal", "conservative")
}


class LongLife(NamedTuple):
    """Agents that live on, in windows of ticks or after their first optimal policy."""

    preset: str
    changes: Mapping[str, Any]
    ticks: Mapping[Scale, int]
    level: str = ISLAND
    parent: str = "scripted"
    one_of: int = 30
    cost: float = 1.0


LONG: dict[Scale, int] = {"quick": 100, "paper": 1000}
STAGE_TICKS: dict[Scale, int] = {"quick": 20, "paper": 200}
"""Ticks of each stage before the last, of which windows are kept."""
LONG_LIVES = {
    "frugal, T = 1": LongLife("frugal", {"max_clip_length": 1}, LONG, cost=40.0),
    "frugal, T = 2": LongLife("frugal", {"max_clip_length": 2}, LONG, cost=40.0),
    "conservative, T = 1": LongLife("conservative", {"max_clip_length": 1}, LONG, cost=20.0),
}
"""Lives of ten windows in the last stage."""
LASTING: dict[Scale, int] = {"quick": 40, "paper": 120}
LASTING_LIVES = {
    f"{preset}, {parent}, {LASTING['paper']} ticks": LongLife(preset, {}, LASTING, parent=parent, one_of=10)
    for parent in ("scripted", "noisy:0.1")
    for preset in ("conservative", "frugal")
}
LASTING_LIVES[f"frugal, confirm 0.95, noisy:0.1, {LASTING['paper']} ticks"] = LongLife(
    "frugal", {"confirm": 0.95}, LASTING, parent="noisy:0.1", one_of=10
)
"""Lives that go on after the policy was first optimal."""
GARDEN, GARDEN_WORLD = "garden", "reward-hacking"
GARDENERS = {f"{name}, {GARDEN}": name for name in ("frugal", "conservative")}
"""The preset of each arm in the garden, which has no goal: it is watched for a fixed number of ticks."""
GARDEN_TICKS, GARDEN_ONE_OF = 200, 30
GARDEN_MARKS = tuple(range(0, ANSWERS + 1, 12))
"""Numbers of answers at which its policies are deployed."""
IDEAL = "ideal tabular agent"
IDEAL_TRIALS = 3000

ISLAND_GOAL, BOTTLENECK_GOAL, DEATHS_GOAL = 8.5, 19.0, 0.02
"""Answers until optimal and deaths, at most."""
ASKS_AT_LAST, DIES_AT_LAST = 0.01, 0.001
"""Answers and deaths a tick in the last window, at most."""


def trials_of(name: str, asked: int) -> int:
    """Return how many trials the rows of a name have."""
    if name.startswith(IDEAL):
        return IDEAL_TRIALS
    if name in CHOICES:
        return CHOICE_TRIALS
    if name in GARDENERS:
        return share_of(asked, TRIALS // GARDEN_ONE_OF, TRIALS)
    one_of = ARMS[name][2].one_of if name in ARMS else {**LONG_LIVES, **LASTING_LIVES}[name].one_of
    return share_of(asked, TRIALS // one_of, TRIALS)

"""Events in a run of the reference, so that a comparison can say what it has compared."""

from __future__ import annotations

from collections import Counter
from itertools import product

from parenting.envs.gridworld import WorldState
from parenting.envs.levels.side_effects import stuck
from reference.confirm import Confirming
from reference.frugal import Frugal
from reference.parenting import EXPLOIT, EXPLORE, PREFERENCE, Reference


class EventCoverage(Counter[str]):
    """Counts of what the ticks of a life brought about."""

    def look(self, trial: Reference, before: WorldState) -> None:
        """After a tick: what it made of the world, and of the clips it asks about."""
        world, now = trial.world, trial.state
        self["truncated"] += int(world.truncated(now))
        self["over"] += int(now.terminated)
        self["frozen"] += trial.frozen
        self["unsupervised"] += not trial.supervised
        self["matured twice"] += trial.stage == 3
        self["second level"] += int(now.level) > 0
        if trial.query is not None and trial.query.kind == PREFERENCE:
            _, left, right, maturity = trial.query
            self["ended early"] += min(len(left.actions), len(right.actions)) < maturity
        if isinstance(trial, Confirming):
            self["asked again"], self["overruled"] = trial.repeats, trial.dissents
        if isinstance(trial, Frugal):
            self["answer reused"], self["refusal learnt"] = trial.reused, trial.implied
            self["steps paid late"], self["asked about again"] = trial.late, trial.relabelled
        self["levels look alike"] += look_alike(trial)
        self._cells(trial, before)

    def _cells(self, trial: Reference, before: WorldState) -> None:
        world, now = trial.world, trial.state
        under = world.legend[int(world.tile(now.board, now.agent))]
        self["bucket"] += under == "O"
        self["shortcut"] += under == "P"
        self["pressed"] += under == "B"
        if "T" in world.legend:
            watered = world.code("T")
            self["dried"] += bool(((before.board == watered) & (now.board != watered)).any())
        if int(now.box[0, 0]) >= 0:
            box = int(now.box[0, 0]), int(now.box[0, 1])
            self["box on the goal"] += world.legend[int(world.tile(now.board, now.box))] == "G"
            self["box stuck"] += stuck(world.levels[int(now.level)], box)


def look_alike(trial: Reference) -> bool:
    """Return True if two clips of the recorder begin alike on different levels, with different actions."""
    clips = [[recorded.clip for recorded in trial.clips[kind] if recorded] for kind in (EXPLOIT, EXPLORE)]
    return any(
        e.start == x.start and e.level != x.level and e.actions[0] != x.actions[0] for e, x in product(*clips)
    )

"""Safe reinforcement learning from a parent's guidance and preferences, without a reward signal.

`import parenting as pt` gives the names below; docs/python.md shows them at work. Each name is loaded on its
first use, so that the import alone loads neither torch nor gymnasium, and no part of the server. If Gymnasium
is loaded already, the import registers the worlds with it.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from parenting.agent.config import PRESETS, Config
    from parenting.agent.query import Answer, Choice
    from parenting.agent.state import AgentState
    from parenting.envs.levels.spec import Brief, Level, LevelError, WorldSpec
    from parenting.envs.tables.world import TableWorld
    from parenting.library import testing
    from parenting.library.evaluating import Evaluation, evaluate
    from parenting.library.loop import Tick, configure, init, step, tick
    from parenting.library.parent import Parent
    from parenting.library.person import Person
    from parenting.library.pictures import Drawing
    from parenting.library.policy import Policy, load_policy
    from parenting.library.policy_file import FormatError
    from parenting.library.progress import Progress
    from parenting.library.question import Query, Question
    from parenting.library.replay import ReplayError, ReplayParent
    from parenting.library.result import TrainResult, load_result
    from parenting.library.scripted import ScriptedParent
    from parenting.library.show import show
    from parenting.library.training import train
    from parenting.library.worlds import World, make, register, worlds
    from parenting.server.archive.minari_dataset import to_minari
    from parenting.server.trackers.services import WandbTracker
    from parenting.server.trackers.tracker import TrackedRun, Tracker

_MODULES = {
    "PRESETS": "agent.config",
    "AgentState": "agent.state",
    "Answer": "agent.query",
    "Brief": "envs.levels.spec",
    "Choice": "agent.query",
    "Config": "agent.config",
    "Drawing": "library.pictures",
    "Evaluation": "library.evaluating",
    "FormatError": "library.policy_file",
    "Level": "envs.levels.spec",
    "LevelError": "envs.levels.spec",
    "Parent": "library.parent",
    "Person": "library.person",
    "Policy": "library.policy",
    "Progress": "library.progress",
    "Query": "library.question",
    "Question": "library.question",
    "ReplayError": "library.replay",
    "ReplayParent": "library.replay",
    "ScriptedParent": "library.scripted",
    "TableWorld": "envs.tables.world",
    "Tick": "library.loop",
    "TrackedRun": "server.trackers.tracker",
    "Tracker": "server.trackers.tracker",
    "TrainResult": "library.result",
    "WandbTracker": "server.trackers.services",
    "World": "library.worlds",
    "WorldSpec": "envs.levels.spec",
    "configure": "library.loop",
    "evaluate": "library.evaluating",
    "init": "library.loop",
    "load_policy": "library.policy",
    "load_result": "library.result",
    "make": "library.worlds",
    "register": "library.worlds",
    "show": "library.show",
    "step": "library.loop",
    "tick": "library.loop",
    "to_minari": "server.archive.minari_dataset",
    "train": "library.training",
    "worlds": "library.worlds",
}
"""Every public name with the module that defines it."""

__all__ = [
    "PRESETS",
    "AgentState",
    "Answer",
    "Brief",
    "Choice",
    "Config",
    "Drawing",
    "Evaluation",
    "FormatError",
    "Level",
    "LevelError",
    "Parent",
    "Person",
    "Policy",
    "Progress",
    "Query",
    "Question",
    "ReplayError",
    "ReplayParent",
    "ScriptedParent",
    "TableWorld",
    "Tick",
    "TrackedRun",
    "Tracker",
    "TrainResult",
    "WandbTracker",
    "World",
    "WorldSpec",
    "configure",
    "evaluate",
    "init",
    "load_policy",
    "load_result",
    "make",
    "register",
    "show",
    "step",
    "testing",
    "tick",
    "to_minari",
    "train",
    "worlds",
]


if not TYPE_CHECKING:  # type checkers would take any name for one of ours

    def __getattr__(name: str) -> Any:
        if name == "testing":
            return import_module("parenting.library.testing")
        if name not in _MODULES:
            raise AttributeError(f"module 'parenting' has no attribute '{name}'")
        value = getattr(import_module(f"parenting.{_MODULES[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _register_worlds() -> None:
    gymnasium = sys.modules.get("gymnasium")
    if gymnasium is not None:
        import_module("parenting.envs.gym_ids").register_worlds(gymnasium)


_register_worlds()

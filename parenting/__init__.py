"""Safe reinforcement learning from a parent's guidance and preferences, without a reward signal.

`import parenting as pt` gives the names below; docs/python.md shows them at work. Each name is loaded on its
first use, so that the import alone loads neither torch nor gymnasium, and no part of the server.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from parenting.agent.config import PRESETS, Config
    from parenting.agent.query import Answer, Choice
    from parenting.library.evaluating import Evaluation, evaluate
    from parenting.library.parent import Parent
    from parenting.library.policy import Policy
    from parenting.library.policy_file import load_policy
    from parenting.library.progress import Progress
    from parenting.library.question import Query
    from parenting.library.result import TrainResult
    from parenting.library.result_folder import load_result
    from parenting.library.scripted import ScriptedParent
    from parenting.library.training import train
    from parenting.library.worlds import World, make, worlds

_MODULES = {
    "PRESETS": "agent.config",
    "Answer": "agent.query",
    "Choice": "agent.query",
    "Config": "agent.config",
    "Evaluation": "library.evaluating",
    "Parent": "library.parent",
    "Policy": "library.policy",
    "Progress": "library.progress",
    "Query": "library.question",
    "ScriptedParent": "library.scripted",
    "TrainResult": "library.result",
    "World": "library.worlds",
    "evaluate": "library.evaluating",
    "load_policy": "library.policy_file",
    "load_result": "library.result_folder",
    "make": "library.worlds",
    "train": "library.training",
    "worlds": "library.worlds",
}
"""Every public name with the module that defines it."""

__all__ = [
    "PRESETS",
    "Answer",
    "Choice",
    "Config",
    "Evaluation",
    "Parent",
    "Policy",
    "Progress",
    "Query",
    "ScriptedParent",
    "TrainResult",
    "World",
    "evaluate",
    "load_policy",
    "load_result",
    "make",
    "train",
    "worlds",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'parenting' has no attribute '{name}'")
    value = getattr(import_module(f"parenting.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

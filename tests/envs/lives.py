"""The marks of the checks that every world must pass, and the subjects of these checks."""

from typing import Any

import pytest

from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.library.conformance.walks import Subject, begin, roll, same

__all__ = ["CERTAIN", "begin", "certain", "every_level", "every_world", "roll", "same", "subject"]

CERTAIN: dict[str, dict[str, Any]] = {
    "reward-hacking": {"drying": 0.0},
    "interruptibility": {"interrupts": False},
    "absent-supervisor": {"supervised": True},
}
"""For a world with chance: the options that leave nothing to it."""

every_world = pytest.mark.every_world  # tests/envs/conftest.py says of which worlds: here, of the registry's
every_level = pytest.mark.every_level


def certain(name: str, level: str | None = None) -> Gridworld:
    return registry.make(name, level, **CERTAIN.get(name, {}))


def subject(name: str, level: str | None = None) -> Subject:
    return Subject(name, level or registry.spec(name).default, CERTAIN.get(name, {}))

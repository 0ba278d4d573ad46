"""The ids of the worlds in Gymnasium. Nothing here loads torch, numpy or Gymnasium.

`import parenting.envs.gym` registers them, and so do `import parenting` and, for a world of one's own,
`parenting.register` where Gymnasium is loaded already.
So ``gymnasium.make("parenting:parenting/UnsafeExploration-v0")`` needs no other import.
"""

from __future__ import annotations

import re
from types import ModuleType

from parenting.envs.registry import WORLDS

SINGLE = "parenting.envs.gym:GridworldEnv"
VECTOR = "parenting.envs.gym_vector:GridworldVectorEnv"
FIT = re.compile(r"parenting/[\w:.-]+-v0")
"""The ids of worlds that Gymnasium takes."""


def gym_id(world: str) -> str:
    """The id that a world is registered under, such as ``parenting/UnsafeExploration-v0``."""
    return f"parenting/{world.title().replace('-', '')}-v0"


def register(gymnasium: ModuleType, world: str) -> None:
    """Register a world of the registry under its id, unless it is registered already or no id can hold it.

    Args:
        gymnasium: The module, so that whoever does not want it need not load it.
        world: The world's name.
    """
    name = gym_id(world)
    if name not in gymnasium.registry and FIT.fullmatch(name):
        gymnasium.register(name, entry_point=SINGLE, vector_entry_point=VECTOR, kwargs={"world": world})


def register_worlds(gymnasium: ModuleType) -> None:
    """Register every world. No package of another world is imported before one is made."""
    for world in WORLDS.names():
        register(gymnasium, world)
